/** The sheet of keys, from their one declaration. */

import { html, type TemplateResult } from "lit";

import { KEYS } from "../keys";

export function keyList(): TemplateResult {
  return html`<dl>${KEYS.filter((one) => one.hidden !== true).map((one) => html`<dt><kbd>${one.shown ?? one.key}</kbd></dt><dd>${one.text}</dd>`)}</dl>`;
}
