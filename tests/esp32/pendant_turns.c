/* SPDX-License-Identifier: MIT
 * Pendants at the hub when several act together: which answer is whose, what a turn leaves behind, and what
 * becomes of lines that wait. */
#include "hub_pendants.h"

static unsigned count_of(const char *text, const char *word) {
    unsigned count = 0;
    for (const char *at = text; (at = strstr(at, word)) != NULL; at += strlen(word))
        count++;
    return count;
}

/* A sender that connects while a pendant homes: the first answer that comes is the pendant's, the next its.
 */
static void a_new_owner_gets_its_first_answer(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$H\n");
    now_reads = MACHINE_READS_NOTHING;
    send(WATCHER, "$TAKE\n"); /* an empty line, which waits for the pendant's turn to end */
    wires[PENDANT].out_count = 0;
    now_reads = MACHINE_READS_LINES;
    machine_says("ok\r\n");
    CHECK(strcmp(wires[PENDANT].out, "ok\r\n") == 0);
    wires[WATCHER].out_count = 0;
    wires[WATCHER].out[0] = '\0';
    round_trip();
    machine_says("ok\r\n");
    CHECK(strcmp(wires[WATCHER].out, "ok\r\n") == 0 && hub.inside == 0);
}

/* `~` comes while a line of the operator is under way: from then on the job runs, and has its lines. */
static void a_turn_in_a_parked_hold_ends_with_the_hold(void) {
    begin_with(NET_PENDANT_TERMINAL);
    now_reads = MACHINE_READS_OPERATORS;
    send(PENDANT, "$G\n");
    CHECK(strcmp(got, "$G\n") == 0);
    now_reads = MACHINE_READS_NOTHING;
    send(PENDANT, "~");
    machine_says("ok\r\n");
    CHECK(strcmp(wires[PENDANT].out, "ok\r\n") == 0);
    fresh_lines();
    send(PENDANT, "G0X5\n");
    CHECK(got_count == 0 && strstr(wires[PENDANT].out, "error:183\r\n") != NULL);
    send(OWNER, "G1X9\n");
    CHECK(strcmp(got, "G1X9\n") == 0);
    wires[PENDANT].closed = true;
    round_trip();
    CHECK(pendants_left == 0); /* the job is the sender's */
}

static void it_vanishes_while_it_jogs_in_a_parked_hold(void) {
    begin_with(NET_PENDANT_TERMINAL);
    now_reads = MACHINE_READS_OPERATORS;
    send(PENDANT, "$J=G91X100F100\n");
    machine_says("ok\r\n");
    round_trip();
    wires[PENDANT].closed = true;
    round_trip();
    CHECK(pendants_left == 1);
}

static void damaged_bytes_end_its_jog_in_a_parked_hold(void) {
    begin_with(NET_PENDANT_TERMINAL);
    now_reads = MACHINE_READS_OPERATORS;
    send(PENDANT, "$J=G91X100F100\n");
    machine_says("ok\r\n");
    round_trip();
    fresh_lines();
    wires[PENDANT].damaged = true;
    send(PENDANT, "");
    CHECK(strcmp(got, "\x85") == 0);
}

/* The owner's operator line is the newest: the pendant's end means nothing to its motion. */
static void motion_of_the_owner_in_a_parked_hold_is_not_its(void) {
    begin_with(NET_PENDANT_TERMINAL);
    now_reads = MACHINE_READS_OPERATORS;
    send(PENDANT, "$G\n");
    machine_says("ok\r\n");
    round_trip();
    send(OWNER, "$J=G91X100F100\n");
    machine_says("ok\r\n");
    wires[PENDANT].closed = true;
    round_trip();
    CHECK(pendants_left == 0);
}

/* Whoever cancels: no jog of a pendant that waits runs after that. */
static void a_stop_of_others_calls_off_its_jogs_that_wait(void) {
    static const char stops[] = "!\x85";
    for (unsigned n = OWNER; n <= WATCHER; n += WATCHER - OWNER)
        for (const char *stop = stops; *stop != '\0'; stop++) {
            begin_with(NET_PENDANT_TERMINAL);
            full = true;
            send(PENDANT, "$J=G91X1F100\n$J=G91X2F100\n");
            full = false;
            wires[n].in_count = 1;
            wires[n].in[0] = *stop;
            net_hub_read(&hub, &hub.client[n]);
            fresh_lines();
            round_trip();
            CHECK(strcmp(got, "\n\n") == 0);
        }
}

#define TEN_JOGS                                                                                             \
    "$J=G91X1F100\n$J=G91X1F100\n$J=G91X1F100\n$J=G91X1F100\n$J=G91X1F100\n"                                 \
    "$J=G91X1F100\n$J=G91X1F100\n$J=G91X1F100\n$J=G91X1F100\n$J=G91X1F100\n"

/* They came before the stop, and no one has read them yet: what the hub has read is chance. */
static void a_stop_of_others_calls_off_its_jogs_that_are_not_read_yet(void) {
    static const char stops[] = "!\x85";
    for (unsigned n = OWNER; n <= WATCHER; n += WATCHER - OWNER)
        for (const char *stop = stops; *stop != '\0'; stop++) {
            begin_with(NET_PENDANT_TERMINAL);
            full = true;
            send(PENDANT, "$J=G91X5F100\n$J=G91");
            full = false;
            put_on_wire(PENDANT, "X5F100\n" TEN_JOGS TEN_JOGS "$G\n");
            put_on_wire(n, (const char[]){*stop, '\0'});
            net_hub_read(&hub, &hub.client[n]);
            CHECK(got_count == 1 && got[0] == *stop); /* it comes before all reading */
            fresh_lines();
            for (unsigned round = 0; round < 30; round++)
                machine_says(round < 1 ? "" : "ok\r\n");
            CHECK(strcmp(got, "\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n$G\n") == 0);
        }
}

/* Its bytes keep their order, whoever stops in them, and what comes behind its own stop is new. */
static void a_stop_of_a_pendant_calls_off_the_owners_jogs_that_are_not_read_yet(void) {
    begin_with(NET_PENDANT_TERMINAL);
    full = true;
    send(OWNER, "$J=G91X5F100\n");
    full = false;
    put_on_wire(OWNER, "$J=G91X6F100\n\x90G1X1\n");
    put_on_wire(PENDANT, "\x85$J=G91Y1F100\n\x85$J=G91Y2F100\n");
    net_hub_read(&hub, &hub.client[PENDANT]);
    CHECK(strcmp(got, "\x85\x85") == 0);
    fresh_lines();
    for (unsigned round = 0; round < 6; round++)
        machine_says("ok\r\n");
    CHECK(strcmp(got, "\x90\n\n\nG1X1\n$J=G91Y2F100\n") == 0); /* one is the pendant's first */
}

/* Of a sender that has ended its half of the connection, as `nc` does: they would run behind the stop. */
static void a_stop_calls_off_jogs_of_a_former_owner(void) {
    begin_with(NET_PENDANT_TERMINAL);
    full = true;
    send(OWNER, "G1X1\n$J=G91X1F100\n$G\n");
    wires[OWNER].ended = true;
    round_trip();
    full = false;
    CHECK(hub.owner == NULL && hub.left.count > 0);
    put_on_wire(WATCHER, "\x85");
    net_hub_read(&hub, &hub.client[WATCHER]);
    fresh_lines();
    round_trip();
    CHECK(strcmp(got, "G1X1\n\n$G\n") == 0);
}

static void a_reset_of_others_forgets_what_is_not_read_yet(void) {
    begin_with(NET_PENDANT_TERMINAL);
    put_on_wire(PENDANT, TEN_JOGS TEN_JOGS "$J=G91");
    put_on_wire(OWNER, "\x18");
    net_hub_read(&hub, &hub.client[OWNER]);
    fresh_lines();
    machine_says("\r\nGrbl 1.1h ['$' for help]\r\n");
    round_trip();
    send(PENDANT, "X100F100\n");
    CHECK(got_count == 0); /* not the rest of a half one either */
    send(PENDANT, "$G\n");
    CHECK(strcmp(got, "$G\n") == 0);
}

/* Who takes control stops jogs; its own line behind that is new, in one packet, too. */
static void a_jog_right_behind_take_runs(void) {
    begin_with(NET_PENDANT_TERMINAL);
    put_on_wire(OWNER, "$J=G91X5F100\n");
    send(WATCHER, "$TAKE\n$J=G91Z1F100\n");
    machine_says("ok\r\n");
    machine_says("ok\r\n");
    CHECK(strstr(got, "$J=G91Z1F100\n") != NULL && strstr(strchr(got, '\x85'), "$J=G91X5") == NULL);
}

/* The owner ends control by 0x8B, which stops the pendant's jogs, not its own behind that. */
static void a_jog_right_behind_take_runs_after_mpg(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "\x8b");
    CHECK(hub.mpg);
    send(OWNER, "$TAKE\n$J=G91Z1F100\n");
    CHECK(!hub.mpg);
    for (unsigned round = 0; round < 3; round++)
        machine_says("ok\r\n");
    CHECK(strstr(got, "$J=G91Z1F100\n") != NULL);
}

/* A line behind one's own reset is new, whoever holds at that moment: it has no other answer. */
static void a_hold_of_others_forgets_no_line_behind_a_reset(void) {
    for (unsigned n = PENDANT; n <= WATCHER; n++) {
        begin_with(NET_PENDANT_TERMINAL);
        put_on_wire(OWNER, "\x18$X\n$J=G91X1F100\n");
        put_on_wire(n, "!");
        net_hub_read(&hub, &hub.client[OWNER]);
        net_hub_read(&hub, &hub.client[n]);
        fresh_lines();
        for (unsigned round = 0; round < 3; round++)
            machine_says(round < 1 ? "" : "ok\r\n");
        CHECK(strcmp(got, "$X\n\n") == 0);
    }
}

/* The same where the reset is not read yet when the hold comes. */
static void a_hold_before_a_reset_forgets_no_line_behind_it(void) {
    begin_with(NET_PENDANT_TERMINAL);
    put_on_wire(OWNER, "G1X5\n\x18$X\n");
    put_on_wire(WATCHER, "!");
    net_hub_read(&hub, &hub.client[WATCHER]);
    (void)net_hub_feed(&hub);
    CHECK(strcmp(got, "!\x18$X\n") == 0);
}

/* More than the owner's queue can hold is on its way. */
static void a_stop_calls_off_more_jogs_than_wait(void) {
    static const char jog[] = "$J=G91X1F100 (a jog of a sender that never waits, of some length)\n";
    begin_with(NET_PENDANT_TERMINAL);
    hub.sizes.in = 2 * sizeof jog;
    for (unsigned i = 0; i < 7; i++, wires[OWNER].in_count += sizeof jog - 1)
        memcpy(wires[OWNER].in + wires[OWNER].in_count, jog, sizeof jog - 1);
    put_on_wire(WATCHER, "\x85");
    net_hub_read(&hub, &hub.client[WATCHER]);
    fresh_lines();
    for (unsigned round = 0; round < 60; round++)
        machine_says(round < 1 ? "" : "ok\r\n");
    CHECK(got_count > 0 && strchr(got, 'J') == NULL && wires[OWNER].in_count == 0);
}

/* The same where they are forgotten. */
static void a_reset_forgets_more_lines_than_wait(void) {
    static const char line[] = "G1X1F100 (a line of a sender that never waits, of some length or so)\n";
    begin_with(NET_PENDANT_TERMINAL);
    hub.sizes.in = 2 * sizeof line;
    for (unsigned i = 0; i < 7; i++, wires[OWNER].in_count += sizeof line - 1)
        memcpy(wires[OWNER].in + wires[OWNER].in_count, line, sizeof line - 1);
    put_on_wire(PENDANT, "\x18");
    net_hub_read(&hub, &hub.client[PENDANT]);
    fresh_lines();
    machine_says("\r\nGrbl 1.1h ['$' for help]\r\n");
    round_trip();
    CHECK(got_count == 0 && wires[OWNER].in_count == 0);
}

/* Half a line is under way when someone else resets: its rest is no line. */
static void the_rest_of_a_line_after_a_reset_of_others_is_no_line(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$J=G91 Z1 F100 (");
    send(OWNER, "\x18");
    machine_says("\r\nGrbl 1.1h ['$' for help]\r\n");
    fresh_lines();
    send(PENDANT, ")G0X100\n");
    CHECK(got_count == 0);
    send(PENDANT, "$G\n");
    CHECK(strcmp(got, "$G\n") == 0);
}

static void the_rest_of_the_owners_line_after_a_reset_of_a_pendant_is_no_line(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(OWNER, "G1 F100 (");
    send(PENDANT, "\x18");
    machine_says("\r\nGrbl 1.1h ['$' for help]\r\n");
    fresh_lines();
    send(OWNER, ")X100\n");
    CHECK(got_count == 0);
    send(OWNER, "$G\n");
    CHECK(strcmp(got, "$G\n") == 0);
}

/* What follows its own reset is a new line. */
static void after_its_own_reset_a_line_begins(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$J=G91\x18");
    machine_says("\r\nGrbl 1.1h ['$' for help]\r\n");
    fresh_lines();
    send(PENDANT, "$G\n");
    CHECK(strcmp(got, "$G\n") == 0);
}

/* Lines that have not begun when control ends: each has its answer, behind those before it. */
static void lines_that_wait_when_control_ends_are_answered(void) {
    for (unsigned by = OWNER; by <= PENDANT; by++) {
        begin_with(NET_PENDANT_MPG);
        send(PENDANT, "\x8b$G\n");
        full = true;
        send(PENDANT, "$J=G91X1F100\nG0X5\n\n");
        send(by, by == PENDANT ? "\x8b" : "$TAKE\n");
        full = false;
        fresh_lines();
        wires[PENDANT].out_count = 0;
        wires[PENDANT].out[0] = '\0';
        machine_says("ok\r\n");
        round_trip();
        CHECK(strstr(got, "G0") == NULL && strstr(got, "$J") == NULL);
        const char *first = strstr(wires[PENDANT].out, "ok\r\n"),
                   *refused = strstr(wires[PENDANT].out, "error:");
        CHECK(first != NULL && refused != NULL && first < refused);
        for (unsigned i = 0; i < 3; i++)
            machine_says(hub.inside_hand > 0 ? "ok\r\n" : "");
        CHECK(count_of(wires[PENDANT].out, "ok\r\n") + count_of(wires[PENDANT].out, "error:") == 4);
    }
}

static void garbage_is_answered_in_its_turn(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$G\n$\x01\n$#\n");
    CHECK(wires[PENDANT].out_count == 0);
    machine_says("[GC:G0]\r\nok\r\n");
    round_trip();
    CHECK(strcmp(wires[PENDANT].out,
                 "[GC:G0]\r\nok\r\n"
                 "[MSG:Pendant: unreadable bytes; check its baud rate, cable and ground]\r\nerror:11\r\n") ==
          0);
    CHECK(strcmp(got, "$G\n$#\n") == 0);
}

/* It does not wait for answers: memory is bounded, what stops is obeyed, and each line is answered. */
static void a_flood_is_bounded_and_it_can_still_stop(void) {
    enum { LINES = 4000 };
    static const char line[] = "$J=G91 X1 F100\n";
    unsigned answers = 0;
    begin_with(NET_PENDANT_TERMINAL);
    now_reads = MACHINE_READS_SOON;
    for (unsigned i = 0; i < LINES; i++)
        send(PENDANT, line);
    CHECK(hub.client[PENDANT].in.count <= hub.sizes.in);
    send(PENDANT, "!");
    CHECK(strcmp(got, "!") == 0);
    now_reads = MACHINE_READS_LINES;
    fresh_lines();
    for (unsigned i = 0; i < 2 * LINES; i++) {
        wires[PENDANT].out_count = 0;
        wires[PENDANT].out[0] = '\0';
        fresh_lines();
        machine_says(hub.inside_hand > 0 ? "ok\r\n" : "");
        answers += count_of(wires[PENDANT].out, "ok\r\n") + count_of(wires[PENDANT].out, "error:");
    }
    CHECK(answers == LINES);
    CHECK(wires[PENDANT].closed == false);
}

/* What runs is the pendant's; the sender's lines that wait must not run without it. */
static void a_sender_that_is_lost_does_not_end_its_jog(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$J=G91X100F100\n");
    machine_says("ok\r\n");
    now_reads = MACHINE_READS_NOTHING;
    send(OWNER, "G1X5\n");
    wires[OWNER].closed = true;
    round_trip();
    CHECK(owners_left == 0);
    fresh_lines();
    now_reads = MACHINE_READS_LINES;
    left_before_lines = false;
    round_trip();
    CHECK(owners_left == 1 && waited && left_before_lines);
}

static void a_sender_that_does_not_read_does_not_lock_it_out(void) {
    static char much[sizeof says];
    begin_with(NET_PENDANT_TERMINAL);
    stuck = &wires[OWNER];
    memset(much, 'x', sizeof much);
    memcpy(much, "[MSG:", 5);
    memcpy(much + 300, "]\r\n", 4);
    while (hub.client[OWNER].out.count < hub.sizes.out) {
        machine_says(much);
        wires[PENDANT].out_count = wires[WATCHER].out_count = 0;
    }
    fresh_lines();
    send(PENDANT, "$J=G91X1F100\n");
    CHECK(strcmp(got, "$J=G91X1F100\n") == 0);
}

/* Two lines of the owner in the parked hold are not answered, and neither are those of its job. */
static void an_answer_of_the_owner_in_a_parked_hold_is_not_its(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(OWNER, "G1X9\nG1X8\n");
    now_reads = MACHINE_READS_NOTHING;
    send(OWNER, "!\xa3");
    machine_says("ok\r\n"); /* the job's first line, while the axes slow down */
    now_reads = MACHINE_READS_OPERATORS;
    send(OWNER, "$J=G91Z5F100\n");
    now_reads = MACHINE_READS_SOON; /* it is not answered yet */
    fresh_lines();
    send(PENDANT, "$G\n");
    CHECK(got_count == 0);
    machine_says("ok\r\n");
    now_reads = MACHINE_READS_OPERATORS;
    CHECK(strstr(wires[OWNER].out, "ok\r\n") != NULL && strstr(wires[PENDANT].out, "ok\r\n") == NULL);
    round_trip();
    CHECK(strcmp(got, "$G\n") == 0);
    machine_says("ok\r\n");
    CHECK(strstr(wires[PENDANT].out, "ok\r\n") != NULL);
}

/* Lines without end, of a pendant that is broken: the sender has its turn between them. */
static void an_endless_pendant_does_not_lock_the_owner_out(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$G\n$G\n");
    send(OWNER, "G1X5\n");
    for (unsigned i = 0; i < 8 && strstr(got, "G1X5") == NULL; i++) {
        strcpy(says, hub.inside > 0 ? "ok\r\n" : "");
        send(PENDANT, "$G\n$G\n");
    }
    CHECK(strstr(got, "G1X5\n") != NULL);
}

/* Each is answered its own line, and the other waits. */
static void two_pendants_have_their_own_answers(void) {
    start_hub("", 4);
    CHECK(come(OWNER, true));
    come_as_pendant(PENDANT, NET_PENDANT_TERMINAL);
    come_as_pendant(WATCHER, NET_PENDANT_TERMINAL);
    send(PENDANT, "$G\n");
    send(WATCHER, "$#\n");
    CHECK(strcmp(got, "$G\n") == 0);
    machine_says("[GC:G0]\r\nok\r\n");
    CHECK(strcmp(wires[PENDANT].out, "[GC:G0]\r\nok\r\n") == 0 && wires[WATCHER].out_count == 0);
    round_trip();
    machine_says("[G54:0]\r\nok\r\n");
    CHECK(strcmp(wires[WATCHER].out, "[G54:0]\r\nok\r\n") == 0 && wires[OWNER].out_count == 0);
    CHECK(strcmp(wires[PENDANT].out, "[GC:G0]\r\nok\r\n") == 0);
}

/* Of a letter of UTF-8, or noise. */
static void mpg_in_a_line_takes_no_control(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$J=G91X1F100 (\xc3\x8b)\n");
    CHECK(!hub.mpg && strstr(got, "$J") == NULL);
    CHECK(strstr(wires[PENDANT].out, "unreadable") != NULL &&
          strstr(wires[PENDANT].out, "error:11\r\n") != NULL);
    send(PENDANT, "\x8b");
    CHECK(hub.mpg);
}

int main(void) {
    mpg_in_a_line_takes_no_control();
    a_new_owner_gets_its_first_answer();
    a_turn_in_a_parked_hold_ends_with_the_hold();
    it_vanishes_while_it_jogs_in_a_parked_hold();
    damaged_bytes_end_its_jog_in_a_parked_hold();
    motion_of_the_owner_in_a_parked_hold_is_not_its();
    a_stop_of_others_calls_off_its_jogs_that_wait();
    a_stop_of_others_calls_off_its_jogs_that_are_not_read_yet();
    a_stop_of_a_pendant_calls_off_the_owners_jogs_that_are_not_read_yet();
    a_stop_calls_off_jogs_of_a_former_owner();
    a_reset_of_others_forgets_what_is_not_read_yet();
    a_jog_right_behind_take_runs();
    a_jog_right_behind_take_runs_after_mpg();
    a_hold_of_others_forgets_no_line_behind_a_reset();
    a_hold_before_a_reset_forgets_no_line_behind_it();
    a_stop_calls_off_more_jogs_than_wait();
    a_reset_forgets_more_lines_than_wait();
    the_rest_of_a_line_after_a_reset_of_others_is_no_line();
    the_rest_of_the_owners_line_after_a_reset_of_a_pendant_is_no_line();
    after_its_own_reset_a_line_begins();
    lines_that_wait_when_control_ends_are_answered();
    garbage_is_answered_in_its_turn();
    a_flood_is_bounded_and_it_can_still_stop();
    a_sender_that_is_lost_does_not_end_its_jog();
    a_sender_that_does_not_read_does_not_lock_it_out();
    an_answer_of_the_owner_in_a_parked_hold_is_not_its();
    an_endless_pendant_does_not_lock_the_owner_out();
    two_pendants_have_their_own_answers();
    net_hub_close(&hub);
    return report();
}
