/* SPDX-License-Identifier: MIT
 * Who has the file that keeps settings: of two programs that write, each would drop what the other has
 * stored. */
#ifndef WIFICNC_PC_SERVE_CLAIM_H
#define WIFICNC_PC_SERVE_CLAIM_H

/** Claim the file for this process, by a lock on FILE.lock. @return -1 and *error: EISDIR, EINVAL (not a
 * file), ENOENT (its folder), EAGAIN (another process has it) or another errno */
int serve_claim(const char *path, int *error);

/** @param claim  of serve_claim(), or -1 */
void serve_release(int claim);

#endif
