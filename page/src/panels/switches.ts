/** The switches of what the map shows. */

import { html } from "lit";

import { SWITCHES } from "../view";
import type { Panel } from "./panel";

export const switchPanel: Panel = {
  id: "switches",
  title: "Show",
  draw: ({ view, actions }) => html`<ul class="switches">${SWITCHES.map(([name, key, text]) => html`
    <li class=${name}><label><input type="checkbox" .checked=${view.shown[name]}
      @change=${() => actions.toggle(name)}> ${text} <kbd>${key}</kbd></label></li>`)}</ul>`,
};
