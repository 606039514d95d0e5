/** The filters of the tracks: they hold for the map and the table. */

import { html, nothing, type TemplateResult } from "lit";

import { isBandEmpty, isFiltered } from "../view/shown";
import { FOOT_M } from "../view/units";
import type { Filters } from "../view/view";
import type { App } from "./panel";

const STATES = ["confirmed", "tentative", "coasting"];
const NONE: Filters = { text: "", fromM: null, toM: null, sensor: "", state: "", area: false };

export function filterForm({ view, store, actions, clock }: App): TemplateResult {
  const { filters, units } = view;
  const perUnit = units === "aero" ? 100 * FOOT_M : 1;
  const unit = units === "aero" ? "FL" : "m";
  const bound = (name: "fromM" | "toM", label: string): TemplateResult => {
    const value = filters[name];
    return html`<label>${label} <input type="number" inputmode="numeric" step=${units === "aero" ? 10 : 100}
      aria-invalid=${isBandEmpty(filters)} .value=${value === null ? "" : String(Number((value / perUnit).toFixed(2)))}
      @input=${(event: Event) => {
        // What is half a number yet is left to the user.
        if (!(event.target as HTMLInputElement).validity.badInput) actions.filter({ [name]: numberOf(event, perUnit) });
      }}></label>`;
  };
  return html`<div class="filters" role="search" aria-label="Track filters">
    <input type="search" id="filter" placeholder="Callsign, code, address or number  ( / )" aria-label="Search tracks"
      .value=${filters.text} @input=${(event: Event) => actions.filter({ text: textOf(event) })}
      @keydown=${(event: KeyboardEvent) => toRows(event)}>
    <div class="fields">
      ${clock.runs.length < 2 ? nothing : html`<label>Run <select @change=${(event: Event) =>
        actions.run((event.target as HTMLSelectElement).selectedIndex === 1 ? 1 : 0)}>${clock.runs.slice(0, 2).map((name, number) =>
        html`<option ?selected=${number === view.run}>${name}</option>`)}</select></label>`}
      ${bound("fromM", `${unit} from`)}${bound("toM", "to")}
      ${choice("Sensor", store.sensors, filters.sensor, (sensor) => actions.filter({ sensor }))}
      ${choice("State", STATES, filters.state, (state) => actions.filter({ state }))}
      <label class="check"><input type="checkbox" .checked=${filters.area}
        @change=${() => actions.filter({ area: !filters.area })}> Only the map area</label>
      ${isFiltered(filters) ? html`<button type="button" @click=${() => actions.filter(NONE)}>Clear filters</button>` : nothing}
    </div></div>`;
}

function choice(label: string, values: readonly string[], chosen: string, take: (value: string) => void): TemplateResult {
  // One that is gone stays visible: it still filters.
  const all = chosen === "" || values.includes(chosen) ? values : [...values, chosen];
  return html`<label>${label} <select @change=${(event: Event) => take((event.target as HTMLSelectElement).value)}>
    <option value="" ?selected=${chosen === ""}>any</option>
    ${all.map((value) => html`<option value=${value} ?selected=${value === chosen}>${value}</option>`)}</select></label>`;
}

function textOf(event: Event): string {
  return (event.target as HTMLInputElement).value;
}

function numberOf(event: Event, perUnit: number): number | null {
  const text = textOf(event).trim();
  const value = Number(text);
  return text === "" || !Number.isFinite(value) ? null : value * perUnit;
}

/** From the search into the table. */
function toRows(event: KeyboardEvent): void {
  if (event.key !== "ArrowDown" && event.key !== "Enter") return;
  event.preventDefault();
  document.querySelector<HTMLElement>("#tracks tbody tr[tabindex='0']")?.focus();
}
