/** What each panel gets, and what it returns. */

import type { TemplateResult } from "lit";

import type { Encounters } from "../encounters";
import type { Feed } from "../feed";
import type { Picture } from "../picture";
import type { Selection } from "../selection";
import type { Store } from "../store";
import type { Switch, ViewState } from "../view";

export interface Actions {
  select(id: number | null): void;
  show(id: number): void;
  toggle(name: Switch): void;
  filter(text: string): void;
  units(): void;
  theme(): void;
  help(): void;
  /** Draw the panels now, and keep the view in the address. */
  changed(): void;
}

/** The page: what it knows, what the user chose and what can be done. */
export interface App {
  store: Store;
  feed: Feed;
  view: ViewState;
  selection: Selection;
  encounters: Encounters;
  picture: Picture;
  actions: Actions;
}

export interface Panel {
  /** The id of its element. */
  id: string;
  title: string;
  draw(app: App): TemplateResult;
}
