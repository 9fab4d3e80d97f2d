/** The tabs that set a board up, in one file that comes with the first of them. */
export { GuideTab } from "./guide";
export { InOutTab } from "./inout";
export { InstallTab } from "./install";
export { NetworkTab } from "./network";
export { PinsTab } from "./pins";
