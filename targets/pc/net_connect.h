/* SPDX-License-Identifier: MIT
 * Connections that this computer opens. */
#ifndef WIFICNC_PC_NET_CONNECT_H
#define WIFICNC_PC_NET_CONNECT_H

/** Connect by TCP, and wait for it: for addresses of this computer, where no one waits long.
 *  @return the socket, or -1 */
int net_connect(const char *host, const char *port);

#endif
