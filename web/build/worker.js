/* Keeps one whole version of the page: it comes from here, also without a network. A newer one is fetched meanwhile and
 * takes over at a start at which no window has the older one, so a window never mixes two. Firmware and whatever else
 * lies next to the page comes from the network. The build fills in the version and the files. */
const VERSION = "VERSION";
const FILES = ["FILES"];
const CACHE = `wificnc-${VERSION}`;

async function keep() {
  const cache = await caches.open(CACHE);
  await cache.addAll(FILES.map((name) => new Request(name, { cache: "no-cache" })));
}

async function forgetOthers() {
  const names = await caches.keys();
  await Promise.all(names.filter((name) => name.startsWith("wificnc-") && name !== CACHE).map((name) => caches.delete(name)));
}

/* Its name next to this worker; a folder is its index.html. */
function nameOf(url) {
  const folder = new URL("./", location.href).href;
  if (!url.href.startsWith(folder)) return "";
  return decodeURIComponent(url.href.slice(folder.length).split(/[?#]/)[0]) || "index.html";
}

async function answer(request, name) {
  const cache = await caches.open(CACHE);
  return (await cache.match(name)) ?? fetch(request);
}

addEventListener("install", (event) => event.waitUntil(keep()));
addEventListener("activate", (event) => event.waitUntil(forgetOthers()));
addEventListener("fetch", (event) => {
  const name = nameOf(new URL(event.request.url));
  if (event.request.method === "GET" && FILES.includes(name)) event.respondWith(answer(event.request, name));
});
