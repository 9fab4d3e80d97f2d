/* Above the table of states: a list of the states, and words that a row must have. The address keeps both. */
(() => {
  const table = document.querySelector("#states table");
  const rows = [...table.tBodies[0].rows].map((row) => ({
    row,
    state: row.cells[0].textContent,
    text: row.textContent.toLowerCase(),
  }));
  const form = document.createElement("form");
  const state = form.appendChild(document.createElement("select"));
  const words = form.appendChild(document.createElement("input"));
  const count = form.appendChild(document.createElement("output"));
  state.ariaLabel = "State";
  state.append(new Option("all states", ""), ...[...new Set(rows.map((row) => row.state))].map((name) => new Option(name, name)));
  Object.assign(words, { type: "search", size: 40, placeholder: "words, such as: $H error:9", ariaLabel: "Words of a row" });
  form.style.cssText = "display: flex; flex-wrap: wrap; gap: 0.5em; margin: 1em 0";
  for (const field of [state, words]) field.style.cssText = "font: inherit; color: inherit; background: inherit; border: 1px solid; padding: 0.3em";

  function show() {
    const wanted = words.value.toLowerCase().split(/\s+/);
    let shown = 0;
    for (const { row, state: name, text } of rows) {
      row.hidden = (state.value !== "" && state.value !== name) || !wanted.every((word) => text.includes(word));
      shown += row.hidden ? 0 : 1;
    }
    count.value = `${shown} of ${rows.length} rows`;
  }

  const asked = new URLSearchParams(location.search);
  state.value = asked.get("state") ?? "";
  words.value = asked.get("words") ?? "";
  form.addEventListener("input", () => {
    show();
    history.replaceState(null, "", `?${new URLSearchParams({ state: state.value, words: words.value })}`);
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  table.parentElement.before(form);
  show();
})();
