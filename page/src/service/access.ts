/** The key of this tab: the service asks for one where clients need credentials. */

const NAME = "multiradar-key";
/** What a header can carry. */
const KEY = /^[\x21-\x7e]+$/;
let listens = false;
/** With it the service counts this page among those that are open. */
const PAGE = { "x-multiradar-page": crypto.getRandomValues(new Uint32Array(2)).join("-") };

/** Of two recorded runs, that whose documents are read; those of the second are under a path of their own. */
let path = "";

/** Read the documents of the first run, 0, or of the second, 1. */
export function readRun(number: 0 | 1): void {
  path = number === 0 ? "" : "second/";
}

/** Request with the key; a user without a valid one is asked for it, and the next request has it. */
export async function request(address: string, options: RequestInit): Promise<Response> {
  const key = sessionStorage.getItem(NAME);
  const answer = await fetch(address.startsWith("v1/") ? `${path}${address}` : address, { ...options, headers: key === null ? PAGE : { ...PAGE, authorization: `Bearer ${key}` } });
  // Another request may have asked meanwhile.
  if (answer.status === 401 && key === sessionStorage.getItem(NAME)) ask(key !== null);
  return answer;
}

function ask(wrong: boolean): void {
  const dialog = document.getElementById("access") as HTMLDialogElement;
  const input = dialog.querySelector("input[type=password]") as HTMLInputElement;
  const reason = dialog.querySelector("p") as HTMLElement;
  reason.textContent = wrong ? "This key is not valid." : "";
  if (!listens) {
    listens = true;
    dialog.querySelector("form")?.addEventListener("submit", (event) => {
      const key = input.value.trim();
      if (KEY.test(key)) {
        // Until the tab is closed; no other site and no other tab reads it.
        sessionStorage.setItem(NAME, key);
        input.value = "";
      } else {
        event.preventDefault();
        reason.textContent = "This key is not valid.";
      }
    });
  }
  if (!dialog.open) dialog.showModal();
}

/** Follow a link to a document of the service; the browser alone would request it without the key. */
export async function follow(event: Event): Promise<void> {
  if (sessionStorage.getItem(NAME) === null) return;
  event.preventDefault();
  const { href } = event.currentTarget as HTMLAnchorElement;
  window.open(URL.createObjectURL(await (await request(href, {})).blob()));
}
