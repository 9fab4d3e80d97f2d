/* SPDX-License-Identifier: MIT
 * Many clients, one controller. One client at a time, the owner, commands; all others are observers and see
 * every answer.
 *
 *   clients -> real-time bytes: immediately            -> controller -> whole lines -> every client
 *           -> lines: queue `in` -> `left` of former owners, then the owner's ->
 *
 * Ownership: when no one owns, whoever first sends anything but `?` does. It ends with the connection;
 * `$TAKE` as a line takes it at any time: what moves is held, a jog ends, and lines that have not begun are
 * refused, whoever has sent them, behind the line of their client that is under way. The whole lines of an
 * owner whose connection has ended are still run, a half line is not; the answers to those lines are for all
 * but a new owner that has not sent them: the owner's lines, also those of before it lost control, are
 * answered once each, in order.
 *
 * The sender is the owner, or the client that was it last and has only ended its half of the connection: it
 * still hears answers, so what it sent runs on (`nc` ends so). When it is gone for good, the controller
 * learns it (ops->left), and holds what no one looks after.
 *
 * A reset of the controller, whoever asked for it, forgets every line that waits here: with the banner
 * senders begin again.
 *
 * Where there is an access key (access/access.h), a client from an address that is not trusted is locked out
 * at first: its `?` is answered, it may hold and stop, it sees nothing but reports, and a login lets it in:
 * `$LOGIN` is answered by `[LOGIN:nonce,salt,rounds]`, and `$LOGIN=proof` of that, or `$LOGIN=key` of a
 * person who types, opens. A login that must wait for its turn (base/lockout.h) waits, and so does what its
 * client sends after it.
 * `$TRUST=day` or `always` of a client that is in lets all clients of its address in from now on, `$TRUST=no`
 * ends that; `$TRUST` lists such addresses, `$TRUST=no 2` ends the second's, `$TRUST=none` all.
 * `$QR` is answered by the address of the page as a QR code, with the access key for who has a cable.
 * Such lines, which the hub answers itself, act and are answered in their client's turn (net_hub_turn.c).
 *
 * `$RI=ms` and 0x8C of a client, of a locked one, too, are its own: automatic reports go to the client that
 * has asked for them, while it reads. They end with the connection, and with a reset.
 *
 * A pendant (net_hub_pendant.c) is a hand at the machine: it never owns, its real-time bytes act as the
 * owner's, and its lines are read between those of the owner when nothing runs.
 *
 * No client shuts others out: one that says nothing is disconnected after some seconds, and net_places.h
 * chooses who goes for a newcomer when all places are taken. A browser that was made to send a request to a
 * port of lines (net_opening.h) is refused before anything of it acts.
 *
 * Nothing is lost for want of room. A controller that is full, or an owner that does not read its answers,
 * stops the reading of the owner's lines; an observer that does not read is disconnected.
 *
 * No socket call, no clock, no global: the streams and the controller are ops. Single-threaded. */
#ifndef WIFICNC_NET_HUB_H
#define WIFICNC_NET_HUB_H

#include "access/access.h"
#include "hal/net_sizes.h" // NET_CLIENTS, of the target
#include "machine/pendant.h"
#include "machine/report_interval.h"
#include "net_queue.h"
#include "net_stream.h"
#include "net_telnet.h"

#include <stdint.h>

/** NET_ANSWER_MAX: the controller's longest answer to one line, but that to $# with some forty tools or more;
 * all settings are half of it. */
enum { NET_NAME_SIZE = 40, NET_MESSAGE_SIZE = 192, NET_LINE_SIZE = 384, NET_ANSWER_MAX = 4096 };

/** Of the controller's room for lines a job leaves so much to the operator of a parked hold. */
enum { NET_OPERATOR_BYTES = 320 };

/** How much may wait in the hub, bytes. A controller with little RAM takes small ones. */
struct net_hub_sizes {
    size_t clients; /* 1 .. NET_CLIENTS connections at the same time */
    size_t in;      /* of the owner's lines; a longer line continues as it comes */
    size_t out;  /* of answers that wait for one client; >= 2 * NET_ANSWER_MAX. An owner gets twice as much */
    size_t left; /* of former owners' lines */
};

/** What the hub asks of the controller and its surroundings. */
struct net_hub_ops {
    /** Give it bytes. @return bytes taken; real-time bytes are always taken */
    size_t (*put)(void *ctx, const char *bytes, size_t count);
    /** Count bytes that a stream has lost or that came damaged. May be NULL where no stream reports that.
     *  @param what  NET_LOST or NET_UNFRAMED */
    void (*lost)(void *ctx, long what);
    /** The line that comes next, or that has begun, is to be refused. NULL as above. @return false: no room
     */
    bool (*spoil)(void *ctx);
    /** Its output. @return bytes copied, 0: nothing more */
    size_t (*hear)(void *ctx, char *bytes, size_t size);
    /** Let it act on real-time bytes now. */
    void (*act)(void *ctx);
    /** Something happened to a client, for a log: "connected", "owner", ... */
    void (*event)(void *ctx, const char *what, const char *who);
    /** The sender's connection has ended; NULL: never mind. @param lines_wait  the controller has not got all
     *  its lines yet */
    void (*left)(void *ctx, bool lines_wait);
    /** Messages for a new client. @param number  0, 1, .. until it returns false: no more. NULL: there are
     *  none */
    bool (*notice)(void *ctx, unsigned number, char *text, size_t size);
    /** The access key, for who has a cable to the controller; may be NULL, and return NULL. */
    const char *(*key)(void *ctx);
    /** The address of the page, such as http://10.0.0.7/. NULL: this controller has no page @return false: no
     * network has given it one yet */
    bool (*page)(void *ctx, char *text, size_t size);
    /** Lines or motion are under way: who only listens stays that long. May be NULL */
    bool (*busy)(void *ctx);
    /** How often the start button was pressed with nothing to start; wraps. NULL: there is none */
    uint8_t (*presses)(void *ctx);
    /** Whether a line of a pendant would be read now. NULL: there are no pendants */
    enum machine_reads (*reads)(void *ctx);
    /** A pendant is gone in its turn. As above */
    void (*pendant_left)(void *ctx);
    /** A pendant has control, or not any more: reports say so. As above */
    void (*mpg)(void *ctx, bool on);
    /** Of whom lines are that it gets now. NULL: of the job in any case */
    enum machine_whose (*whose)(void *ctx);
    /** Stops so far, wraps: a ~ from before one counts no more. NULL as above */
    uint8_t (*stops)(void *ctx);
    /** A jog of the text side moves. NULL as above */
    bool (*jogs)(void *ctx);
    /** machine_stopped_by_other(). NULL as above */
    void (*stopped_by_other)(void *ctx);
    /** Bytes of lines that it would take now. NULL where `whose` is */
    size_t (*room)(void *ctx);
    /** Drop the job's lines that have not begun. @return how many. NULL: they are run */
    uint32_t (*drop_unread)(void *ctx);
};

/** Lines of a client that wait. */
struct net_hub_lines {
    struct net_queue in;
    size_t whole;
    bool in_long, called_off, skips, refuses_rest; /* as those of net_client */
};

struct net_client {
    struct net_stream stream; /* .ops NULL: a free place */
    char name[NET_NAME_SIZE];
    struct net_telnet telnet;
    struct net_queue in, out;
    size_t whole;        /* bytes of `in` up to the last line end */
    bool after_cr;       /* an LF would be the second half of a line end */
    bool in_long;        /* the controller has got the begin of the line that continues in `in` */
    bool called_off;     /* ... or that line began before a jog cancel: a jog must not run */
    bool skips;          /* in the middle of a line that no one takes */
    bool refuses_rest;   /* ... and that is refused at its end */
    bool asks, asks_all; /* a ? or 0x87 that waits */
    bool is_due;         /* the next report is its automatic one */
    bool ended;          /* sends no more; stays until it has heard the answers */
    bool gone;           /* to be removed */
    bool locked;         /* not logged in; `in` is the line that it types */
    bool by_trust;       /* it was let in because its address is trusted, not by the key */
    bool in_left;        /* some of these may be its own: its next answers come behind theirs */
    bool hears_left;     /* gets the answers to lines of former owners, too */
    bool spoiled;        /* the line that comes next, or has begun, is to be refused */
    bool opened;         /* judged by its first bytes, which `in` holds until then; or need not be */
    bool refused;        /* ... and is a browser's: takes no more, goes when it has its answer */
    bool spoke;          /* said something useful */
    bool waits;          /* `in` begins with a login that waits for its turn; what came after it follows */
    uint8_t text_left;   /* bytes of a letter of UTF-8 that still come (input/text_byte.h) */
    uint8_t login_size;  /* of that line */
    uint32_t heard_us;   /* when it last said something useful, as a login that waits */
    uint32_t came_us;    /* when it connected */
    struct report_interval reports; /* its automatic ones */
    uint32_t reported_us;           /* when the newest of these was due */
    bool braked;  /* an observer or locked client that has held the machine: it may reset it, too */
    bool told;    /* ... and one that has not, that it may not. A pendant: that its bytes are unreadable */
    bool garbled; /* a pendant's line has bytes that no line has */
    uint32_t lost_lines; /* of a pendant or a former owner, that found no room, and are to be refused */
    bool paused;         /* a pendant has sent XOFF: it reads nothing before XON */
    bool explained;      /* has the reason why its lines are refused: once for all that came together */
    char typed[13];      /* by an observer, in its line: $TRUST=always is the longest that it may send; of a
                            locked client the number of its question */
    uint8_t letters;     /* of these; UINT8_MAX: too many. Of a locked client: whether it has a question */
};

/** The owner's lines in a parked hold (net_hub_parked.c). */
struct net_hub_parked {
    bool on;                     /* lines of the owner are the operator's */
    bool opened;                 /* ... and the controller has read such lines, or would have */
    bool resumes;                /* ~ waits for them */
    uint8_t stops;               /* ... which counts no more when there are others than these */
    uint8_t inside;              /* so many the controller has, and answers before all others */
    size_t before_resume;        /* while `resumes`: lines of the owner's before the ~ */
    struct net_client *operator; /* whose they are */
    struct net_queue unread;     /* lines of it that are refused behind their answers */
    struct net_hub_lines job;    /* the owner's from before 0xA3 */
    struct net_client *hand;     /* the pendant whose turn waits, as its line or motion is held; or NULL */
    uint8_t inside_hand;         /* of `inside`, that pendant's: answered behind the operator's */
};

struct net_hub {
    const struct net_hub_ops *ops;
    void *ctx;
    struct net_hub_sizes sizes;
    struct access *access; /* whoever owns the hub sets and polls it; NULL: no client is locked out */
    struct net_client client[NET_CLIENTS];
    struct net_client *owner;  /* NULL: no one */
    bool owner_is_new;         /* ... and no line of it has ended since it is the owner */
    struct net_client *sender; /* it answers for what runs; NULL: no one does */
    bool has_pendants;         /* one has come since the start: only then is any looked for */
    struct net_client *hand;   /* the pendant whose turn it is: lines of others wait; NULL: no one's */
    bool mpg;                  /* ... by 0x8B, until it gives control back: lines of others are refused */
    uint8_t inside_hand;       /* of `inside`, the pendant's in its turn, which are answered first */
    uint8_t hand_stops;        /* ops->stops() when its turn began */
    bool hand_parked;          /* ... it began in a parked hold: it ends when its lines are answered */
    bool others_first;         /* a pendant has had its turn, and others wait */
    bool sender_lost; /* in a pendant's turn, whose motion continues: the controller learns it after it */
    struct net_client *operators; /* the newest line of a parked hold's operator was this pendant's */
    struct net_hub_parked parked;
    uint64_t owner_peer;   /* address of the owner or of the last one, whom a place is kept for; 0: none */
    uint32_t now_us;       /* of the last net_hub_tick() */
    struct net_queue left; /* whole lines of former owners that the controller has not got yet (net_line.h) */
    uint8_t left_of;       /* its first lines are of the client of this place + 1; 0: of one that is gone */
    uint32_t questions;    /* ever asked by $LOGIN: each has its number */
    struct net_hub_knock { /* an address that is locked out, and tries to command */
        uint64_t peer;     /* 0: none */
        uint64_t host;     /* as that of its stream */
        uint32_t first_us, last_us;
        bool more; /* others have tried, too */
    } knock;
    const struct net_queue *jogs;         /* of whose lines the newest jog was; NULL: there was none */
    const struct net_queue *stopped_jogs; /* lines that wait behind what a stop of this round ends; or NULL */
    uint8_t presses;                      /* of the start button, that were seen */
    bool has_lost;                        /* clients other than pendants may have lost_lines */
    bool has_spoiled;                     /* NET_LINE_SPOILED may be among what waits */
    bool asked, asked_for_due;            /* a report was, by a client, and for those that are due */
    bool stops, resets;                   /* this round has had a hold or a jog cancel; a reset */
    const struct net_client *stopped_by, *reset_by; /* ... the newest of whom: lines behind it are new */
    uint32_t inside;                                /* lines the controller has got and not answered */
    uint32_t inside_left;                           /* the oldest of these are former owners': */
    uint8_t inside_of[NET_LINES_INSIDE];            /* of each of them as left_of, the oldest first */
    char line[NET_LINE_SIZE];                       /* of the controller's output, as far as it was read */
    size_t line_size;
};

void net_hub_init(struct net_hub *hub, const struct net_hub_sizes *sizes, const struct net_hub_ops *ops,
                  void *ctx);

/** Everyone is disconnected, all memory given back. */
void net_hub_close(struct net_hub *hub);

/** A new connection; the hub owns its stream now. @return false: no place; it got a message and was closed */
bool net_hub_connect(struct net_hub *hub, const struct net_stream *stream, const char *name);

/** Time passes: silent clients are disconnected, logins get their turn. Call it every round, before
 * connections are accepted. @param now_us  wraps */
void net_hub_tick(struct net_hub *hub, uint32_t now_us);

/** All places are taken. */
bool net_hub_is_full(const struct net_hub *hub);

/** Whether this client's stream should be read, and whether something waits to be written to it. */
bool net_hub_wants_read(const struct net_hub *hub, const struct net_client *client);
bool net_hub_wants_write(const struct net_client *client);

/** The client's stream can be read: takes 1 KB at most, so that what comes first is fed before what comes
 * last.
 *  @return true: there may be more */
bool net_hub_read(struct net_hub *hub, struct net_client *client);

/** The client's stream has failed. */
void net_hub_lost(struct net_client *client);

/** Give lines to the controller, as many as it takes and as there is room for the answers of.
 *  @return true: it took something */
bool net_hub_feed(struct net_hub *hub);

/** Pass the controller's output on to all clients. */
void net_hub_hear(struct net_hub *hub);

/** Pass observers' `?` on, as one; call it as often as they shall be answered at most. */
void net_hub_ask(struct net_hub *hub);

/** Write what waits, remove who is gone. */
void net_hub_flush(struct net_hub *hub);

/** [MSG:text] to all. */
void net_hub_tell(struct net_hub *hub, const char *text);

#endif
