/** From an https address the page can be installed and starts without a network. Browsers allow that nowhere else, and
 * at localhost the next controller's page would come from the last one's. */
export function startOffline(): void {
  if (location.protocol !== "https:" || !("serviceWorker" in navigator)) return;
  const manifest = document.createElement("link");
  manifest.rel = "manifest";
  manifest.href = "./app.webmanifest";
  document.head.append(manifest);
  navigator.serviceWorker.register("./sw.js").catch(console.warn); // then it only needs the network, as any page
}
