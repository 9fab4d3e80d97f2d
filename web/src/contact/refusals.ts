/** What a controller answers to a change that it refuses (targets/esp32/net/portal.c), for the catalogue. */
import { msg } from "../words";

export const REFUSALS: readonly string[] = [
  msg`A password has 8 to 63 characters; a network without one has none.`,
  msg`Address, netmask and gateway do not fit together.`,
  msg`No network is on trial.`,
  msg`Not understood: docs/web.md lists the members of this request.`,
  msg`Pins that another client has set cannot be stored.`,
  msg`The access key of the controller is missing.`,
  msg`The controller cannot search now: the machine is moving, or a search is under way.`,
  msg`The controller cannot store it.`,
  msg`The machine is moving. Stop it, or wait until it stops.`,
  msg`The mode is dhcp or static.`,
  msg`The name of a network has 1 to 32 bytes.`,
  msg`The name of the controller has up to 31 letters, digits and inner hyphens.`,
  msg`The password is missing; send an empty one for an open network.`,
  msg`These are the settings that are already in use.`,
  msg`This is not an IPv4 address such as 192.168.1.1.`,
  msg`This is not an IPv4 address such as 192.168.1.50.`,
  msg`This is not an IPv4 netmask such as 255.255.255.0.`,
  msg`This is not the access key.`,
  msg`This shows that the own network works. Connect to the new network and open the page there.`,
];
