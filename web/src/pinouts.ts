/** The pictures of the boards (boards/pinout, made from the board files), as files next to the page. */
const urls = import.meta.glob<string>("../../boards/pinout/*.svg", { query: "?url", import: "default", eager: true });

/** "" for a board without a picture. */
export function pinoutUrl(id: string): string {
  return urls[`../../boards/pinout/${id}.svg`] ?? "";
}
