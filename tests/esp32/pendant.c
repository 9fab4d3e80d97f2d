/* SPDX-License-Identifier: MIT
 * A pendant at the hub: whose turn it is, whose answers they are, control by 0x8B, and its end. The machine's
 * side of it is tested against `wificnc serve` (tests/serve/test_serve_pendant.py). */
#include "hub_pendants.h"

static void at_rest_its_line_is_read_and_answered_to_it_alone(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "\x11?\x0c$G\n");
    CHECK(strcmp(got, "?$G\n") == 0);
    CHECK(hub.owner == &hub.client[OWNER]); /* it takes nothing over */
    wires[OWNER].out_count = 0;
    machine_says("[GC:G0 G54]\r\nok\r\n");
    CHECK(strcmp(wires[PENDANT].out, "[GC:G0 G54]\r\nok\r\n") == 0);
    CHECK(wires[OWNER].out_count == 0);
    machine_says("<Idle>\r\n[MSG:hello]\r\n"); /* news are for all */
    CHECK(strstr(wires[OWNER].out, "<Idle>") != NULL && strstr(wires[PENDANT].out, "[MSG:hello]") != NULL);
}

static void answers_of_the_owner_are_not_its(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(OWNER, "G1X1\n");
    machine_says("ok\r\n");
    CHECK(strcmp(wires[OWNER].out, "ok\r\n") == 0 && wires[PENDANT].out_count == 0);
}

/* While its jog moves the owner's lines wait, and they are fed when it has ended. */
static void lines_of_the_owner_wait_for_its_turn(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$J=G91X1F100\n");
    machine_says("ok\r\n");
    now_reads = MACHINE_READS_NOTHING; /* it jogs */
    fresh_lines();
    send(OWNER, "G1X5\n");
    CHECK(got_count == 0 && wires[OWNER].out_count == 0);
    send(PENDANT, "$J=G91X1F100\n");
    CHECK(strcmp(got, "$J=G91X1F100\n") == 0);
    machine_says("ok\r\n");
    fresh_lines();
    now_reads = MACHINE_READS_LINES;
    round_trip();
    CHECK(strcmp(got, "G1X5\n") == 0);
}

static void while_a_job_runs_its_lines_are_refused_and_it_may_hold(void) {
    begin_with(NET_PENDANT_TERMINAL);
    now_reads = MACHINE_READS_NOTHING;
    send(PENDANT, "$J=G91X1F100\n\n$G\n");
    CHECK(got_count == 0);
    CHECK(strcmp(wires[PENDANT].out,
                 "[MSG:Pendant: a job runs or is held; hold and park it (0xA3) to jog]\r\n"
                 "error:183\r\nok\r\nerror:183\r\n") == 0);
    send(PENDANT, "!~\x90\x18");
    CHECK(strcmp(got, "!~\x90\x18") == 0);
    now_reads = MACHINE_READS_LINES;
    fresh_lines();
    round_trip();
    CHECK(got_count == 0); /* nothing of what was refused comes later */
}

/* The owner's line is not answered yet: who would get which answer? */
static void it_waits_for_answers_that_are_due(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(OWNER, "$$\n");
    now_reads = MACHINE_READS_SOON;
    fresh_lines();
    send(PENDANT, "$G\n");
    send(OWNER, "$#\n");
    CHECK(got_count == 0);
    now_reads = MACHINE_READS_LINES;
    machine_says("$0=10\r\nok\r\n");
    CHECK(strcmp(wires[OWNER].out, "$0=10\r\nok\r\n") == 0 && wires[PENDANT].out_count == 0);
    round_trip();
    CHECK(strcmp(got, "$G\n") == 0);
    machine_says("ok\r\n");
    CHECK(strcmp(wires[PENDANT].out, "ok\r\n") == 0);
    round_trip();
    CHECK(strcmp(got, "$G\n$#\n") == 0);
}

/* The job's lines that wait in the hold are answered after the pendant's. */
static void in_a_parked_hold_it_is_the_operator(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(OWNER, "G1X9\nG1X8\n");
    now_reads = MACHINE_READS_NOTHING;
    send(PENDANT, "!\xa3");
    now_reads = MACHINE_READS_OPERATORS;
    fresh_lines();
    send(PENDANT, "$J=G91Z5F100\n");
    CHECK(strcmp(got, "$J=G91Z5F100\n") == 0);
    machine_says("ok\r\n");
    CHECK(strstr(wires[PENDANT].out, "ok") != NULL && wires[OWNER].out_count == 0);
    send(PENDANT, "~");
    now_reads = MACHINE_READS_NOTHING;
    machine_says("ok\r\nok\r\n");
    CHECK(strcmp(wires[OWNER].out, "ok\r\nok\r\n") == 0);
    CHECK(hub.inside == 0 && hub.hand == NULL);
}

static void it_vanishes_while_it_jogs(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$J=G91X100F100\n");
    machine_says("ok\r\n");
    send(PENDANT, "$J=G91X100F100\n");
    now_reads = MACHINE_READS_NOTHING;
    wires[PENDANT].closed = true;
    round_trip();
    CHECK(pendants_left == 1 && hub.hand == NULL); /* the machine ends the jog: tests/states */
    fresh_lines();
    send(OWNER, "G1X5\n");
    CHECK(got_count == 0); /* an answer to the pendant's line is due */
    now_reads = MACHINE_READS_LINES;
    machine_says("ok\r\n");
    CHECK(wires[OWNER].out_count == 0);
    round_trip();
    CHECK(strcmp(got, "G1X5\n") == 0);
}

static void without_a_turn_its_end_means_nothing(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(OWNER, "G1X5\n");
    now_reads = MACHINE_READS_NOTHING;
    wires[PENDANT].closed = true;
    round_trip();
    CHECK(pendants_left == 0 && hub.owner == &hub.client[OWNER]);
}

static void garbage_is_one_message_and_one_answer_each(void) {
    static const char once[] = "[MSG:Pendant: unreadable bytes; check its baud rate, cable and ground]\r\n"
                               "error:11\r\n";
    char longest[400];
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$J=G\x02\x7fX1\n");
    CHECK(strcmp(wires[PENDANT].out, once) == 0);
    memset(longest, 'x', sizeof longest);
    memcpy(longest + sizeof longest - 2, "\n", 2);
    send(PENDANT, longest);
    while (wires[PENDANT].in_count > 0)
        round_trip();
    CHECK(strcmp(wires[PENDANT].out, "error:11\r\n") == 0);
    CHECK(got_count == 0);
    send(PENDANT, "$G\n");
    CHECK(strcmp(got, "$G\n") == 0);
    machine_says("ok\r\n");
    send(PENDANT, "\x01\n");
    CHECK(strcmp(wires[PENDANT].out, once) == 0);
}

static void damaged_bytes_end_its_jog(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "$J=G91X100F100\n");
    machine_says("ok\r\n");
    now_reads = MACHINE_READS_NOTHING;
    fresh_lines();
    wires[PENDANT].damaged = true;
    send(PENDANT, "$J=G91X1F100\n");
    CHECK(strcmp(got, "\x85") == 0);
    CHECK(strstr(wires[PENDANT].out, "error:11") != NULL);
}

static void a_jog_cancel_calls_off_what_waits(void) {
    begin_with(NET_PENDANT_TERMINAL);
    full = true;
    send(PENDANT, "$J=G91X1F100\n$J=G91X1F100\n");
    full = false;
    send(PENDANT, "\x85$G\n");
    CHECK(strcmp(got, "\x85\n\n$G\n") == 0);
}

static void it_reads_nothing_between_xoff_and_xon(void) {
    begin_with(NET_PENDANT_TERMINAL);
    send(PENDANT, "\x13");
    machine_says("<Idle>\r\n");
    CHECK(wires[PENDANT].out_count == 0);
    send(PENDANT, "\x11");
    round_trip();
    CHECK(strcmp(wires[PENDANT].out, "<Idle>\r\n") == 0);
}

static void control_by_8b_refuses_the_lines_of_others(void) {
    begin_with(NET_PENDANT_MPG);
    send(PENDANT, "$J=G91X1F100\n");
    CHECK(strstr(wires[PENDANT].out, "0x8B takes control") != NULL && got_count == 0);
    send(PENDANT, "\x8b");
    CHECK(shows_mpg && hub.mpg);
    send(OWNER, "G1X5\n\nG1X6\n");
    CHECK(strstr(wires[OWNER].out,
                 "[MSG:The pendant is in control (MPG): 0x8B at the pendant, or $TAKE, ends "
                 "that]\r\nerror:183\r\nok\r\nerror:183\r\n") != NULL);
    send(OWNER, "?!");
    CHECK(strcmp(got, "?!") == 0); /* real-time commands stay */
    fresh_lines();
    send(PENDANT, "$J=G91X1F100\n");
    CHECK(strcmp(got, "$J=G91X1F100\n") == 0);
    machine_says("ok\r\n");
    CHECK(strstr(wires[PENDANT].out, "ok\r\n") != NULL);
    fresh_lines();
    send(PENDANT, "\x8b");
    CHECK(!shows_mpg && strcmp(got, "\x85") == 0);
    fresh_lines();
    send(OWNER, "G1X5\n");
    round_trip();
    CHECK(strcmp(got, "G1X5\n") == 0);
}

static void control_needs_a_machine_at_rest(void) {
    begin_with(NET_PENDANT_MPG);
    now_reads = MACHINE_READS_NOTHING;
    send(PENDANT, "\x8b");
    CHECK(!shows_mpg && strstr(wires[PENDANT].out, "needs a machine at rest") != NULL);
    now_reads = MACHINE_READS_LINES;
    full = true;
    send(OWNER, "G1X5\n");
    full = false;
    wires[PENDANT].in_count = 1; /* the owner's line is first */
    wires[PENDANT].in[0] = '\x8b';
    net_hub_read(&hub, &hub.client[PENDANT]);
    CHECK(!shows_mpg && !hub.mpg);
}

static void control_ends_with_the_pendant_and_with_take(void) {
    begin_with(NET_PENDANT_MPG);
    send(PENDANT, "\x8b");
    CHECK(hub.mpg);
    wires[PENDANT].closed = true;
    round_trip();
    CHECK(!shows_mpg && !hub.mpg && pendants_left == 1);
    for (unsigned n = OWNER; n <= WATCHER; n += WATCHER - OWNER) { /* the owner's, and an observer's */
        begin_with(NET_PENDANT_MPG);
        send(PENDANT, "\x8b");
        send(n, "$TAKE\n");
        CHECK(!shows_mpg && !hub.mpg && hub.owner == &hub.client[n]);
    }
}

/* As grblHAL: a reset does not give control back. */
static void a_reset_keeps_control(void) {
    begin_with(NET_PENDANT_MPG);
    send(PENDANT, "\x8b");
    machine_says("\r\nGrbl 1.1h ['$' for help]\r\n");
    CHECK(hub.mpg && hub.hand == &hub.client[PENDANT]);
}

int main(void) {
    at_rest_its_line_is_read_and_answered_to_it_alone();
    answers_of_the_owner_are_not_its();
    lines_of_the_owner_wait_for_its_turn();
    while_a_job_runs_its_lines_are_refused_and_it_may_hold();
    it_waits_for_answers_that_are_due();
    in_a_parked_hold_it_is_the_operator();
    it_vanishes_while_it_jogs();
    without_a_turn_its_end_means_nothing();
    garbage_is_one_message_and_one_answer_each();
    damaged_bytes_end_its_jog();
    a_jog_cancel_calls_off_what_waits();
    it_reads_nothing_between_xoff_and_xon();
    control_by_8b_refuses_the_lines_of_others();
    control_needs_a_machine_at_rest();
    control_ends_with_the_pendant_and_with_take();
    a_reset_keeps_control();
    net_hub_close(&hub);
    return report();
}
