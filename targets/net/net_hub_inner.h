/* SPDX-License-Identifier: MIT
 * What the hub's files share: net_hub.c has lines and owners, net_hub_left.c lines of former owners,
 * net_hub_stop.c stops, net_hub_say.c messages, net_hub_reports.c reports, net_hub_places.c connections,
 * net_hub_access.c who is let in, net_hub_pendant.c pendants, net_hub_parked.c the operator of a parked
 * hold, net_hub_qr.c the link of $QR, net_hub_turn.c when lines that the hub answers have their turn. */
#ifndef WIFICNC_NET_HUB_INNER_H
#define WIFICNC_NET_HUB_INNER_H

#include "net_hub.h"

#include "gcode/status.h"

extern const char net_hub_locked_out[];

/** Real-time bytes that stop the machine, besides `!`. */
enum { RESET = 0x18, DOOR = 0x84, JOG_CANCEL = 0x85, FULL_STATUS = 0x87, MPG_TOGGLE = 0x8B, PARK = 0xA3 };

static inline bool net_hub_is_open(const struct net_client *client) {
    return client->stream.ops != NULL && !client->gone;
}

/* ---- net_hub_say.c ---- */

extern const char net_hub_nobody[];

/** An observer that does not read is disconnected; so is an owner, but much later. */
void net_hub_say(struct net_hub *hub, struct net_client *client, const char *bytes, size_t count);

void net_hub_say_message(struct net_hub *hub, struct net_client *client, const char *text);

/** The answer to a line that has no effect: each line has one, so that no sender waits for ever.
 * @param why  a message before it; NULL: it has that already */
void net_hub_refuse(struct net_hub *hub, struct net_client *client, enum status status, const char *why);

/** Notices for a client that may take control from now on. */
void net_hub_greet(struct net_hub *hub, struct net_client *client);

/** [MSG:text] to all but the owner. */
void net_hub_tell_observers(struct net_hub *hub, const char *text);

/** Who is in control. */
void net_hub_explain(struct net_hub *hub, struct net_client *observer);

/* ---- net_hub_stop.c ---- */

/** The first byte of a line that waits, and that the hub answers to this client (NET_LINE_MARK). */
char net_hub_mark_of(const struct net_hub *hub, const struct net_client *client);

/** Jogs that wait must not run any more. */
void net_hub_call_off_jogs(struct net_client *client);

/** A real-time byte of who may command, or a stop of who may stop, has come. */
void net_hub_take_realtime(struct net_hub *hub, struct net_client *client, uint8_t byte);

/** Give it to the controller. */
void net_hub_put_realtime(struct net_hub *hub, struct net_client *client, uint8_t byte);

/** Lines of a client that wait are forgotten. */
void net_hub_drop_lines(struct net_client *client);

/** The controller has forgotten all lines. @param by  whose reset it was; NULL: not a client's */
void net_hub_forget_lines(struct net_hub *hub, const struct net_client *by);

/** The round has had a stop: what others have sent before it and is not read yet is as what waits, because
 * how far the hub has read is chance. Before the next line goes to the controller. */
void net_hub_end_stop(struct net_hub *hub);

/* ---- net_hub.c ---- */

/** @param client  NULL: no one */
void net_hub_set_owner(struct net_hub *hub, struct net_client *client);

/** The controller's line has ended, before its LF is added: $TAKE, $RI= and a jog that was called off become
 * empty lines. */
void net_hub_end_line(struct net_hub *hub, struct net_client *client);

/** Give the first `count` bytes of the queue to the controller, line by line.
 *  @param allowed  so many lines may be inside @param keep  of its room @return bytes that it took */
size_t net_hub_feed_lines(struct net_hub *hub, struct net_queue *queue, size_t count, uint32_t allowed,
                          size_t keep);

/** Lines that may be inside the controller, so that the owner's queue has room for their answers. */
uint32_t net_hub_lines_allowed(const struct net_hub *hub);

/** Write what waits for it, as much as its stream takes. */
void net_hub_write(struct net_client *client);

/** The owner's lines that the controller has not answered. */
static inline uint32_t net_hub_owners_inside(const struct net_hub *hub) {
    return hub->inside - hub->inside_left - hub->inside_hand - hub->parked.inside - hub->parked.inside_hand;
}

/** Hubs whose clients from elsewhere are locked out until they are known. */
static inline bool net_hub_locks(const struct net_hub *hub) {
    return hub->access != NULL && !hub->access->open;
}

/** Where there is an access key: clients of this address are let in without it. */
static inline bool net_hub_trusts(const struct net_hub *hub, const struct net_stream *stream) {
    return access_may_at(hub->access, stream->peer, stream->host);
}

/** Look again at a login that waits for its turn. */
void net_hub_log_in_again(struct net_hub *hub, struct net_client *client);

/* ---- net_hub_left.c ---- */

/** It is the owner no more. */
void net_hub_leave_lines(struct net_hub *hub, struct net_client *client);

/** So many more lines that the controller has got are a former owner's.
 * @param of  as hub->left_of */
void net_hub_note_left(struct net_hub *hub, uint8_t of, uint32_t lines);

/** What says whose the next lines of former owners are is taken from their queue. @return true: there was
 * some */
bool net_hub_look_whose(struct net_hub *hub);

/** Whether the next answer to a former owner's line is to a line of this client. */
static inline bool net_hub_left_is_of(const struct net_hub *hub, const struct net_client *client) {
    return hub->inside_left > 0 && hub->inside_of[0] == client - hub->client + 1;
}

/** A former owner's line was answered. */
void net_hub_count_left(struct net_hub *hub);

/** Control is taken: lines that have not begun are refused, whoever has sent them. In the former owner's
 * parked hold: after net_hub_leave_parked(). */
void net_hub_refuse_unread(struct net_hub *hub);

/** The client is gone. */
void net_hub_disown_left(struct net_hub *hub, const struct net_client *client);

/* ---- net_hub_reports.c ---- */

/** A report for this client would find room: else its request waits. Who commands and does not read its
 * answers keeps no report from others. */
bool net_hub_may_ask(const struct net_hub *hub, const struct net_client *client);

/** A client that does not command has sent this byte. @return true: it wants a report */
bool net_hub_want_report(struct net_client *client, uint8_t byte);

/** 0x8C: a client's automatic reports are off, or on as before. @return false: it is another byte */
bool net_hub_toggle_reports(const struct net_hub *hub, struct net_client *client, uint8_t byte);

/** `$RI=` of the owner: the hub sets it, and an empty line is fed, which is answered in its turn. One that
 * is refused is fed as it is: the controller refuses it, too, in its turn.
 * @return true: the interval is set; false: it is refused, or another line */
bool net_hub_take_interval(const struct net_hub *hub, struct net_client *client, const char *line,
                           size_t size);

/** `$RI=` of a client whose lines are not fed, a locked one, too. @return false: it is another line */
bool net_hub_answer_reports(struct net_hub *hub, struct net_client *client, const char *line, size_t size);

/** A reset ends everyone's automatic reports. */
void net_hub_end_reports(struct net_hub *hub);

/** Reports that were asked for are for all, but an owner that does not read; automatic ones for those who
 * read them. */
bool net_hub_gets_report(const struct net_hub *hub, const struct net_client *client);

/** All have it. */
void net_hub_end_report(struct net_hub *hub);

/* ---- net_hub_places.c ---- */

/** It has said something useful. */
void net_hub_note_heard(const struct net_hub *hub, struct net_client *client);

void net_hub_remove_client(struct net_hub *hub, struct net_client *client);

/** Trust was revoked: who is connected because of it, and has not logged in, is disconnected. Trust that has
 * run out ends no connection, so no job. @param asks  who has revoked it: it gets its answer first */
void net_hub_end_untrusted(struct net_hub *hub, const struct net_client *asks);

/* ---- net_hub_access.c ---- */

bool net_hub_is_login(const char *line, size_t size);

/** A locked client's line has ended: a login, or the question what has to be proven. */
void net_hub_log_in(struct net_hub *hub, struct net_client *client);

/** Its login was looked at. */
void net_hub_end_login(struct net_hub *hub, struct net_client *client, enum access_result result);

/** @return ACCESS_WAIT: ask again, it is not its turn */
enum access_result net_hub_try_login(struct net_hub *hub, struct net_client *client);

/** Who may not move the machine may still hold and stop it. Some senders reset whatever they connect to: a
 * reset counts only behind a hold of the same client. */
bool net_hub_may_stop(struct net_hub *hub, struct net_client *client, uint8_t byte);

/** Whether the start button was pressed: who is in front of the machine lets in the one address that has just
 * tried to command, for a day. */
void net_hub_follow_button(struct net_hub *hub);

/** @return the access key, for who has a cable to the controller; NULL: no key, or none for this client */
const char *net_hub_key_for(const struct net_hub *hub, const struct net_client *client);

/** The access key, to who has a cable to the controller. */
void net_hub_tell_key(struct net_hub *hub, struct net_client *client);

/** A login of who is in, or $TRUST. */
bool net_hub_is_access_line(const char *line, size_t size);

void net_hub_answer_access(struct net_hub *hub, struct net_client *client, const char *line, size_t size);

/* ---- net_hub_pendant.c ---- */

static inline bool net_hub_is_pendant(const struct net_client *client) {
    return client->stream.pendant != NET_PENDANT_NONE;
}

/** As the first byte of a pendant's line: it waited behind a jog that was stopped, and is refused. */
enum { NET_PENDANT_STOPPED = 0xFD };

/** A byte of a pendant, other than a request for a report. */
void net_hub_take_pendant(struct net_hub *hub, struct net_client *client, uint8_t byte);

/** Bytes of a pendant were lost or damaged: its jog ends, as no one knows what it has said. */
void net_hub_doubt_pendant(struct net_hub *hub, struct net_client *client);

/** Pendants' lines: they are fed, refused, or wait. @return true: something was fed or refused */
bool net_hub_feed_pendants(struct net_hub *hub);

/** Lines of owners wait for a pendant. */
bool net_hub_waits_for_pendant(const struct net_hub *hub);

/** Its connection has ended: what it moves stops. */
void net_hub_lose_pendant(struct net_hub *hub, struct net_client *client);

/** Control by 0x8B is taken from it. @param by  whose lines behind that are new */
void net_hub_end_mpg(struct net_hub *hub, struct net_client *by);

/** What a pendant has under way is held, and the hold is the operator's: others have their turn in it, too.
 */
void net_hub_put_turn_aside(struct net_hub *hub);

/** The controller has forgotten all lines: whose turn it was, and whose answers are due, is over. */
void net_hub_end_turns(struct net_hub *hub);

/** This line of the controller is for the client, as far as pendants decide that. */
bool net_hub_is_for(const struct net_hub *hub, const struct net_client *client, bool is_news);

/* ---- net_hub_parked.c ---- */

/** Whether the controller takes lines for the operator's. Before they are fed, and behind a byte that changes
 * it. */
void net_hub_follow_parked(struct net_hub *hub);

/** ~ waits for lines of the operator. @return false: there are none */
bool net_hub_keep_resume(struct net_hub *hub);

/** A stop comes, and the controller has it before it acts: of a ~ that waits it takes only that it has ended
 * the operator's lines. */
void net_hub_put_kept_resume(struct net_hub *hub);

/** The owner is it no more: its lines are those of the job. */
void net_hub_leave_parked(struct net_hub *hub);

/** The end of a line has come of which the parked hold's end has dropped the first half. */
void net_hub_refuse_rest(struct net_hub *hub, struct net_client *owner);

/** The controller has forgotten all lines. */
void net_hub_forget_parked(struct net_hub *hub);

/** Lines may come behind those of former owners that are inside, and not answered. A tool change might take
 * them for the operator's, whose answers come first.
 * @param of  as hub->left_of; 0: of the owner, or of one that is gone */
bool net_hub_may_follow_left(const struct net_hub *hub, uint8_t of);

/** @return true: it took something */
bool net_hub_feed_operator(struct net_hub *hub);

/** The operator's line was answered. */
void net_hub_count_operators(struct net_hub *hub);

/** Of the owner's queue: whole lines that are the operator's. */
size_t net_hub_operators_bytes(const struct net_hub *hub);
void net_hub_drop_operators(struct net_hub *hub, size_t count);

/** For an answer, whatever waits of the job. */
static inline bool net_hub_has_room_for_operator(const struct net_hub *hub, const struct net_client *owner) {
    return owner->out.count + NET_ANSWER_MAX <= hub->sizes.out;
}

/* ---- net_hub_qr.c ---- */

/** @return false: it is another line, or this controller has no page */
bool net_hub_is_qr_line(const struct net_hub *hub, const char *line, size_t size);

void net_hub_answer_qr(struct net_hub *hub, struct net_client *client);

/* ---- net_hub_turn.c ---- */

/** The line that has ended, before its LF is added, waits for its turn if it is one that the hub answers.
 * @return false: it is another line */
bool net_hub_mark_line(const struct net_hub *hub, struct net_client *owner);

/** Lines of an observer are answered immediately, behind those that it has sent as the owner. */
void net_hub_answer_observer(struct net_hub *hub, struct net_client *client, const char *line, size_t size);

/** The same of one whose turn it is. */
void net_hub_answer_line(struct net_hub *hub, struct net_client *client, const char *line, size_t size);

/** A line of it had not begun when control was taken: it is refused behind that which is under way. */
void net_hub_refuse_in_turn(struct net_hub *hub, struct net_client *client);

/** A line that finds no room has no effect, and is refused in its turn. */
void net_hub_lose_line(struct net_hub *hub, struct net_client *client);

/** Lines that it has sent before it lost control wait, or answers to them are due. */
static inline bool net_hub_waits_in_left(const struct net_hub *hub, const struct net_client *client) {
    return client->in_left && (hub->left.count > 0 || hub->inside_left > 0);
}

/** There is an owner, and nothing of it that comes before its lines. */
static inline bool net_hub_feeds_owner(const struct net_hub *hub) {
    return hub->owner != NULL && hub->owner->lost_lines == 0;
}

/** Answer the lines whose turn it is. @return true: there was one */
bool net_hub_answer_turns(struct net_hub *hub);

/** A former owner is gone for good: what its lines of the hub set is in force now. */
void net_hub_end_turns_of(struct net_hub *hub, struct net_client *client);

#endif
