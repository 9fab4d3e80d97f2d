/* SPDX-License-Identifier: MIT
 * Lines that the hub answers itself come in their client's turn: each client's answers are in the order of
 * its lines, whatever waits, whoever commands meanwhile, and whatever becomes of the client. */
#include "hub_wires.h"

enum { OWNER = 0, OTHER = 1, CABLE = 2 };

static const char listed[] = "[TRUST:1,10.0.0.255,always]\r\n";

static void begin_turns(void) {
    start("");
    CHECK(access_trust(&the_gate, lockout_ipv4((const uint8_t[4]){10, 0, 0, 255}), ACCESS_ALWAYS));
    CHECK(come(OWNER, false) && come(OTHER, false) && come(CABLE, true));
}

/* The controller answers the oldest line that it has not answered. */
static void answer_one(const char *answer) {
    strcpy(says, answer);
    round_trip();
    round_trip(); /* what has its turn now */
}

static bool heard(unsigned n, const char *text) {
    const bool same = strcmp(wires[n].out, text) == 0;
    if (!same)
        printf("client %u has got: %s\n", n, wires[n].out);
    return same;
}

static void an_owners_answers_are_in_the_order_of_its_lines(void) {
    begin_turns();
    send(OWNER, "G0X1\n$TRUST\nG0X2\n$TRUST=week\n$LOGIN=x\nG0X3\n$trust\n");
    CHECK(strcmp(got, "G0X1\n") == 0 && heard(OWNER, ""));
    answer_one("ok\r\n");
    CHECK(strcmp(got, "G0X1\nG0X2\n") == 0);
    CHECK(heard(OWNER, "ok\r\n[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
    wires[OWNER].out_count = 0;
    answer_one("error:22\r\n");
    CHECK(strcmp(got, "G0X1\nG0X2\nG0X3\n") == 0);
    CHECK(heard(
        OWNER, "error:22\r\n[MSG:$TRUST is no, day, always, none, or no and a number]\r\nerror:3\r\nok\r\n"));
    wires[OWNER].out_count = 0;
    answer_one("ok\r\n");
    CHECK(heard(OWNER, "ok\r\n[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
}

/* What waits is not its own: a login, say, must not wait for a held machine. */
static void who_has_no_line_that_waits_is_answered_immediately(void) {
    begin_turns();
    full = true;
    send(OWNER, "$LOGIN=x\n$TRUST\n");
    CHECK(strncmp(wires[OWNER].out, "ok\r\n[TRUST:1", 12) == 0);
    send(OWNER, "G0X1\nG0X2\n");
    send(OTHER, "$TRUST\n"); /* an observer */
    CHECK(heard(OTHER, "[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
    send(OTHER, "$TAKE\n");
    send(CABLE, "$TRUST\n");
    CHECK(strncmp(wires[CABLE].out, listed, sizeof listed - 1) == 0);
    wires[OTHER].closed = true; /* its empty line waits behind those of the first owner */
    round_trip();
    send(CABLE, "$LOGIN=x\n$TRUST\n"); /* becomes the owner, behind lines of two */
    CHECK(hub.owner == &hub.client[CABLE] && hub.left.count > 0);
    CHECK(strstr(wires[CABLE].out, "ok\r\n[TRUST:1,10.0.0.255,always]\r\nok\r\n") != NULL);
}

static void a_full_controller_and_a_full_queue_keep_the_order(void) {
    static const char *const answers[] = {"error:1\r\n", "error:2\r\n"};
    begin_turns();
    full = true;
    for (unsigned n = 0; n < 100; n++)
        send(OWNER, "G0X1\n$TRUST\nG0X100Y100Z100\n");
    CHECK(hub.owner->in.count >= 2048 && heard(OWNER, ""));
    full = false;
    round_trip();
    CHECK(strcmp(got, "G0X1\n") == 0 && heard(OWNER, ""));
    for (unsigned n = 0; n < 40; n++) {
        char expected[64];
        const bool is_first = n % 2 == 0; /* of the two lines around $TRUST */
        got_count = wires[OWNER].out_count = 0;
        answer_one(answers[n % 2]);
        snprintf(expected, sizeof expected, "%s%s", answers[n % 2], is_first ? listed : "");
        CHECK(heard(OWNER, strcat(expected, is_first ? "ok\r\n" : "")));
        CHECK(strncmp(got, is_first ? "G0X100Y100Z100\nG0X1\n" : "", got_count) == 0);
    }
}

static void a_reset_forgets_them_with_the_other_lines(void) {
    begin_turns();
    send(OWNER, "G0X1\n$TRUST=none\n");
    send(OWNER, "\x18");
    strcpy(says, "\r\nGrbl 1.1h ['$' for help]\r\n");
    round_trip();
    CHECK(hub.owner->in.count == 0 && strstr(wires[OWNER].out, "ok") == NULL);
    CHECK(the_gate.trust[0].who != 0);
    send(OWNER, "$TRUST\n");
    CHECK(heard(OWNER, "[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
    send(OWNER, "G0X1\n$TRUST\n"); /* the controller resets by itself */
    strcpy(says, "\r\nGrbl 1.1h ['$' for help]\r\n");
    round_trip();
    CHECK(strstr(wires[OWNER].out, "TRUST:") == NULL && hub.owner->in.count == 0);
}

static void a_jog_cancel_takes_none_of_them(void) {
    begin_turns();
    full = true;
    send(OWNER, "$J=G91X1F1\n$TRUST\n$J=G91X2F1\n\x85");
    full = false;
    wires[OWNER].out_count = 0;
    round_trip();
    CHECK(strcmp(got, "\n") == 0);
    answer_one("ok\r\n");
    CHECK(heard(OWNER, "ok\r\n[TRUST:1,10.0.0.255,always]\r\nok\r\n") && strcmp(got, "\n\n") == 0);
}

/* It has sent them, and still hears. */
static void a_former_owner_has_its_answers_in_order(void) {
    begin_turns();
    send(OWNER, "G0X1\n$TRUST\nG0X2\n");
    send(OTHER, "$TAKE\nG0X3\n$TRUST\n");
    wires[OTHER].out_count = wires[OWNER].out_count = 0;
    send(OWNER, "$TRUST=week\nG0X4\n\n$RI=1000\n"); /* as an observer: behind its lines of before */
    CHECK(heard(OWNER, "") && strcmp(got, "G0X1\n\x85") == 0);
    got_count = 0;
    answer_one("ok\r\n");
    CHECK(strcmp(got, "G0X2\n") == 0);
    CHECK(heard(OWNER, "ok\r\n[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
    wires[OWNER].out_count = 0;
    answer_one("error:33\r\n");
    CHECK(heard(OWNER,
                "error:33\r\n[MSG:$TRUST is no, day, always, none, or no and a number]\r\nerror:3\r\n"
                "[MSG:Observer: client is in control, $TAKE takes control]\r\nerror:181\r\nok\r\nok\r\n"));
    CHECK(heard(OTHER, "") && strcmp(got, "G0X2\nG0X3\n") == 0);
    answer_one("ok\r\n");
    CHECK(heard(OTHER, "ok\r\n[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
    wires[OWNER].out_count = 0;
    send(OWNER, "$TRUST\n"); /* nothing of it waits any more */
    CHECK(heard(OWNER, "[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
}

/* `nc`: the input has ended, the answers are awaited. */
/* Count answers, each `listed` and ok, or a refusal; the first may have why before it.
 * @return of the ones that are listed, then refused; -1 if any is another, or a listed one behind a refused
 */
static int listed_before_refused(const char *text, const char *why, unsigned *refused) {
    int answered = 0;
    for (*refused = 0; *text != '\0';) {
        const char *end = strchr(text, '\n');
        if (strncmp(text, listed, sizeof listed - 1) == 0 && *refused == 0)
            answered++;
        else if (strncmp(text, "error:181\r", 10) == 0)
            ++*refused;
        else if (strncmp(text, "ok\r", 3) != 0 && strncmp(text, why, strlen(why)) != 0)
            return -1;
        text = end + 1;
    }
    return answered;
}

enum { SENT = 400 };

static void fill_the_queue_of_lines_left(void) {
    begin_turns();
    send(OWNER, "G0X1\n");
    send(OTHER, "$TAKE\n");
    wires[OWNER].out_count = 0;
    for (unsigned n = 0; n < SENT; n++) {
        send(OWNER, "$TRUST\n");
        CHECK(wires[OWNER].out_count == 0);
    }
    CHECK(hub.left.count <= 2048);
}

/* A client that sends on without waiting for answers, while those before wait: it can always stop. */
static void who_was_in_control_has_its_answers_in_order_when_the_queue_is_full(void) {
    unsigned refused = 0;
    fill_the_queue_of_lines_left();
    got_count = 0;
    send(OWNER, "!");
    CHECK(strcmp(got, "!") == 0 && heard(OWNER, ""));
    answer_one("error:22\r\n");
    CHECK(strncmp(wires[OWNER].out, "error:22\r\n[TRUST", 16) == 0);
    round_trip(); /* it has read the first answers */
    const int answered = listed_before_refused(wires[OWNER].out + 10, "[MSG:Too many lines wait", &refused);
    CHECK(answered > 200 && answered + (int)refused == SENT && refused > 0);
    CHECK(strstr(wires[OWNER].out, "[MSG:Too many lines wait") != NULL);
    send(OWNER, "$TRUST\n"); /* nothing of it waits any more */
    CHECK(heard(OWNER, "[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
}

/* Each answer is long, so all of them would be more than may wait for a client. */
static void fill_the_queue_with_long_answers(void) {
    fill_the_queue_of_lines_left();
    for (uint8_t n = 1; n < ACCESS_TRUSTED; n++)
        CHECK(access_trust(&the_gate, lockout_ipv4((const uint8_t[4]){10, 0, 0, n}), ACCESS_ALWAYS));
}

/* @return lines of client 0 that have an answer: the list of all addresses, or a refusal */
static unsigned count_answers(unsigned *listed_ones) {
    unsigned refused = 0;
    *listed_ones = 0;
    for (const char *at = wires[OWNER].out; (at = strstr(at, "[TRUST:2,")) != NULL; at++)
        ++*listed_ones;
    for (const char *at = wires[OWNER].out; (at = strstr(at, "error:181\r\n")) != NULL; at++)
        refused++;
    return *listed_ones + refused;
}

static void who_reads_is_not_disconnected_by_its_answers(void) {
    unsigned listed_ones, answered = 0;
    fill_the_queue_with_long_answers();
    strcpy(says, "ok\r\n");
    for (unsigned n = 0; n < 100 && hub.client[OWNER].stream.ops != NULL; n++) {
        wires[OWNER].out_count = 0;
        wires[OWNER].out[0] = '\0';
        round_trip();
        answered += count_answers(&listed_ones);
    }
    CHECK(hub.client[OWNER].stream.ops != NULL && answered == SENT);
}

static void who_does_not_read_its_answers_keeps_no_one_waiting(void) {
    unsigned listed_ones;
    fill_the_queue_with_long_answers();
    stuck = &wires[OWNER];
    got_count = 0;
    answer_one("ok\r\n"); /* to G0X1 */
    send(OTHER, "G0X5\n");
    CHECK(strcmp(got, "G0X5\n") == 0 && hub.left.count == 0);
    stuck = NULL;
    for (unsigned n = 0; n < 5; n++)
        round_trip();
    CHECK(count_answers(&listed_ones) == SENT && listed_ones > 10);
}

static void its_lines_follow_those_that_found_no_room(void) {
    fill_the_queue_of_lines_left();
    send(OWNER, "$TAKE\nG0X5\n$TRUST\n");
    got_count = 0;
    answer_one("ok\r\n"); /* to G0X1 */
    round_trip();
    CHECK(strcmp(got, "G0X5\n") == 0);
    CHECK(strcmp(wires[OWNER].out + wires[OWNER].out_count - 11, "error:181\r\n") == 0);
    wires[OWNER].out_count = 0;
    answer_one("error:22\r\n");
    CHECK(heard(OWNER, "error:22\r\n[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
}

static void a_reset_forgets_those_that_found_no_room(void) {
    fill_the_queue_of_lines_left();
    strcpy(says, "\r\nGrbl 1.1h ['$' for help]\r\n");
    round_trip();
    wires[OWNER].out_count = 0;
    send(OWNER, "$TRUST\n");
    CHECK(heard(OWNER, "[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
}

/* The other's connection ends: its next line has control, without $TAKE. */
static void who_has_control_again_has_its_answers_in_order(void) {
    begin_turns();
    send(OWNER, "G0X1\n$TRUST\n");
    send(OTHER, "$TAKE\n");
    send(OWNER, "$TRUST=week\n");
    wires[OTHER].closed = true;
    round_trip();
    wires[OWNER].out_count = 0;
    send(OWNER, "$TRUST=no 8\n");
    CHECK(hub.owner == &hub.client[OWNER] && strstr(wires[OWNER].out, "That address") == NULL);
    answer_one("ok\r\n"); /* to G0X1 */
    const char *first = strstr(wires[OWNER].out, listed);
    const char *second = strstr(wires[OWNER].out, "[MSG:$TRUST is no, day");
    const char *third = strstr(wires[OWNER].out, "[MSG:That address");
    CHECK(first != NULL && second > first && third > second);
}

/* A phone takes control in a pause, and goes: `~` of the sender continues its job. */
static void who_has_control_again_has_the_answers_to_its_lines_only(void) {
    begin_turns();
    send(OWNER, "M0\nG0X2\n");
    send(OTHER, "$TAKE\nG0X3\n");
    CHECK(strcmp(got, "M0\nG0X2\n\x85G0X3\n") == 0);
    wires[OTHER].closed = true;
    round_trip();
    send(OWNER, "~");
    send(OWNER, "G0X4\n");
    answer_one("ok\r\nerror:22\r\n");
    CHECK(heard(OWNER, "ok\r\nerror:22\r\n"));
    wires[OWNER].out_count = 0;
    wires[OWNER].out[0] = '\0';
    answer_one("error:1\r\n"); /* of who is gone */
    CHECK(heard(OWNER, ""));
    answer_one("error:3\r\n");
    CHECK(heard(OWNER, "error:3\r\n"));
}

enum { CHANGES = 24 };

/* Two clients take turns in being in control while the machine is held. */
static void however_often_control_changes_all_have_the_answers_to_their_lines(void) {
    char expected[2][64 * CHANGES] = {"", ""};
    begin_turns();
    full = true;
    send(OWNER, "G0X1\n");
    for (unsigned n = 1; n <= CHANGES; n++)
        send(n % 2, "$TAKE\nG0X2\n");
    CHECK(hub.owner == &hub.client[OWNER]);
    full = false;
    wires[OWNER].out_count = 0;
    round_trip();
    for (unsigned n = 0; n < 1 + CHANGES; n++) {
        const unsigned of = n % 2;
        char answer[16];
        got_count = 0;
        strcat(expected[of], n > 1 ? "ok\r\n" : ""); /* to $TAKE, behind a line of before */
        snprintf(answer, sizeof answer, "error:%u\r\n", n + 1);
        strcat(expected[of], answer);
        answer_one(answer);
    }
    CHECK(heard(OWNER, expected[OWNER]));
    CHECK(hub.inside == 0 && hub.left.count == 0);
}

/* Lines of a lost client have no client any more, also where another one has got its place. */
static void who_gets_a_place_hears_no_answers_of_its_former_client(void) {
    begin_turns();
    full = true;
    send(OWNER, "G0X1\n");
    for (unsigned n = 1; n <= CHANGES; n++)
        send(n % 2, "$TAKE\nG0X2\n");
    send(CABLE, "$TAKE\nG0X3\n");
    wires[OTHER].closed = true;
    round_trip();
    wires[OTHER] = (struct wire){.out_count = 0};
    CHECK(come(OTHER, false) && hub.client[OTHER].stream.ops != NULL);
    send(OTHER, "$TAKE\nG0X4\n");
    round_trip();
    full = false;
    wires[OTHER].out_count = 0;
    wires[OTHER].out[0] = '\0';
    round_trip();
    for (unsigned n = 0; n < 1 + CHANGES + 1; n++) {
        got_count = 0;
        answer_one("error:1\r\n");
    }
    CHECK(heard(OTHER, ""));
    answer_one("ok\r\n");
    CHECK(heard(OTHER, "ok\r\n") && hub.inside == 0);
}

/* They have no effect, and are refused in their turn. */
static void lines_that_find_no_room_when_control_changes_are_refused(void) {
    unsigned refused = 0;
    begin_turns();
    full = true;
    for (unsigned n = 0; n < 128; n++)
        send(OWNER, "G0X1Y2Z3A4B5C6F\n");
    send(OTHER, "$TAKE\n$TRUST\nG0X100\n");
    wires[OTHER].out_count = wires[CABLE].out_count = 0;
    send(CABLE, "$TAKE\n");
    CHECK(hub.left.count <= 2048 + 2 && strstr(wires[CABLE].out, "[MSG:Queue full") != NULL);
    CHECK(strstr(wires[OTHER].out, "[MSG:Queue full") != NULL && strstr(wires[OTHER].out, "error") == NULL);
    wires[OTHER].out_count = 0;
    send(OTHER, "$TRUST=week\n"); /* comes behind them */
    full = false;
    for (unsigned n = 0; n < 128 + 1; n++) {
        got_count = 0;
        answer_one("ok\r\n");
    }
    for (const char *at = wires[OTHER].out; (at = strstr(at, "error:181\r\n")) != NULL; at++)
        refused++;
    CHECK(refused == 3 && strstr(wires[OTHER].out, "[MSG:Too many lines wait") != NULL);
    CHECK(strstr(got, "G0X100") == NULL && hub.inside == 0);
}

/* It comes into control again with nothing but half a line, so what waits of it is what it sent before. */
static void owned_twice(void) {
    begin_turns();
    full = true;
    send(OWNER, "G0X1\n");
    send(OTHER, "$TAKE\n");
    send(OWNER, "$TRUST=week\n");
    wires[OTHER].closed = true;
    round_trip();
    send(OWNER, "G0");
    CHECK(hub.owner == &hub.client[OWNER]);
    wires[OWNER].out_count = 0;
}

static void a_lost_clients_turns_are_not_those_of_who_gets_its_place(void) {
    owned_twice();
    wires[OWNER].closed = true;
    round_trip();
    wires[OWNER] = (struct wire){.out_count = 0};
    CHECK(come(OWNER, false) && hub.client[OWNER].stream.ops != NULL);
    wires[OWNER].out_count = 0;
    wires[OWNER].out[0] = '\0';
    full = false;
    round_trip();
    answer_one("ok\r\n"); /* to G0X1 */
    CHECK(hub.left.count == 0 && strstr(wires[OWNER].out, "TRUST") == NULL);
}

static void who_has_lost_control_twice_has_its_answers_in_order(void) {
    owned_twice();
    send(CABLE, "$TAKE\n");
    wires[OWNER].out_count = 0;
    send(OWNER, "\n$TRUST=no 8\n");
    CHECK(heard(OWNER, ""));
}

static void a_sender_whose_input_has_ended_has_its_answers_in_order(void) {
    begin_turns();
    wires[OWNER].ended = true;
    send(OWNER, "G0X1\n$TRUST\n");
    round_trip();
    CHECK(hub.owner == NULL && strstr(wires[OWNER].out, "TRUST:") == NULL);
    wires[OWNER].out_count = 0;
    answer_one("ok\r\n");
    CHECK(heard(OWNER, "ok\r\n[TRUST:1,10.0.0.255,always]\r\nok\r\n"));
}

static void what_a_lost_sender_has_revoked_stays_revoked(void) {
    begin_turns();
    send(OWNER, "G0X1\n$TRUST=none\nG0X2\n");
    wires[OWNER].closed = true;
    round_trip();
    CHECK(the_gate.trust[0].who == 0);
    answer_one("ok\r\n");
    CHECK(strcmp(got, "G0X1\nG0X2\n") == 0);
    CHECK(strstr(wires[OTHER].out, "not trusted") == NULL);
}

/* Client 0 came in by trust: its wish to be trusted waits, and so must not outlast the revocation. */
static void a_revoked_client_does_not_trust_itself_again(void) {
    start("s3cret!?");
    CHECK(access_trust(&the_gate, 1, ACCESS_DAY) && come(0, false) && come(2, true));
    send(0, "G0X1\n$TRUST=always\n");
    send(2, "$TRUST=none\n");
    round_trip();
    CHECK(wires[0].closed && !access_may(&the_gate, 1));
    strcpy(says, "ok\r\n");
    round_trip();
    CHECK(!access_may(&the_gate, 1) && hub.left.count == 0);
}

static void lines_behind_its_own_revocation_do_not_run(void) {
    start("s3cret!?");
    CHECK(access_trust(&the_gate, 1, ACCESS_DAY) && come(0, false));
    send(0, "G0X1\n$TRUST=no\nG0X3\n");
    wires[0].out_count = 0;
    strcpy(says, "ok\r\n");
    round_trip();
    round_trip();
    CHECK(strcmp(got, "G0X1\n") == 0 && wires[0].closed);
    CHECK(heard(0, "ok\r\n[MSG:This address is not trusted any more]\r\nok\r\n"));
}

/* A damaged line, and the rest of one that is longer than the queue, are lines of the controller. */
static void what_only_looks_like_one_is_fed(void) {
    begin_turns();
    for (unsigned n = 0; n < 2048 / 256; n++) {
        char part[257];
        memset(part, 'X', 256);
        part[256] = '\0';
        send(OWNER, part);
    }
    CHECK(hub.owner->in_long);
    got_count = 0;
    send(OWNER, "$TRUST\n");
    CHECK(strcmp(got, "$TRUST\n") == 0);
}

int main(void) {
    an_owners_answers_are_in_the_order_of_its_lines();
    who_has_no_line_that_waits_is_answered_immediately();
    a_full_controller_and_a_full_queue_keep_the_order();
    a_reset_forgets_them_with_the_other_lines();
    a_jog_cancel_takes_none_of_them();
    a_former_owner_has_its_answers_in_order();
    who_was_in_control_has_its_answers_in_order_when_the_queue_is_full();
    who_reads_is_not_disconnected_by_its_answers();
    who_does_not_read_its_answers_keeps_no_one_waiting();
    its_lines_follow_those_that_found_no_room();
    a_reset_forgets_those_that_found_no_room();
    who_has_control_again_has_its_answers_in_order();
    who_has_control_again_has_the_answers_to_its_lines_only();
    however_often_control_changes_all_have_the_answers_to_their_lines();
    who_gets_a_place_hears_no_answers_of_its_former_client();
    lines_that_find_no_room_when_control_changes_are_refused();
    a_lost_clients_turns_are_not_those_of_who_gets_its_place();
    who_has_lost_control_twice_has_its_answers_in_order();
    a_sender_whose_input_has_ended_has_its_answers_in_order();
    what_a_lost_sender_has_revoked_stays_revoked();
    a_revoked_client_does_not_trust_itself_again();
    lines_behind_its_own_revocation_do_not_run();
    what_only_looks_like_one_is_fed();
    net_hub_close(&hub);
    return report();
}
