/** What each panel gets, and what it returns. */

import type { TemplateResult } from "lit";

import type { Encounters } from "../service/encounters";
import type { Feed } from "../service/feed";
import type { Measure } from "../measure/measure";
import type { Overlays } from "../overlays/overlays";
import type { Picture } from "../drawing/picture";
import type { Selection } from "../service/selection";
import type { Store } from "../sky/store";
import type { Ago } from "../time/ago";
import type { Clock } from "../time/clock";
import type { BiasHint } from "./bias_hint";
import type { Filters, Switch, Tab, ViewState } from "../view/view";

export interface Actions {
  /** Select a track, or none; its sheet opens unless `opens` is false. */
  select(id: number | null, opens?: boolean): void;
  show(id: number): void;
  /** Choose one of two recorded runs: table, selection, search and exports are those of it. */
  run(number: 0 | 1): void;
  toggle(name: Switch): void;
  filter(changes: Partial<Filters>): void;
  /** Open a tab; on a narrow screen the open one closes. */
  tab(name: Tab): void;
  /** Open the sheet of a sensor, or close it. */
  sensor(id: string | null): void;
  units(): void;
  theme(): void;
  help(): void;
  /** Draw the panels soon, with the next frame of the screen. */
  redraw(): void;
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
  clock: Clock;
  ago: Ago;
  biasHint: BiasHint;
  measure: Measure;
  overlays: Overlays;
}

export interface Panel {
  /** The id of its element. */
  id: string;
  title: string;
  tab: Tab;
  /** Drawn even when another tab is open. */
  always?: boolean;
  /** A short text beside the title of the tab, or "". */
  badge?(app: App): string;
  draw(app: App): TemplateResult;
}
