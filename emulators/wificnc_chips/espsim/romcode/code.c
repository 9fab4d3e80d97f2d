/* SPDX-License-Identifier: MIT
 * Functions of the boot ROM that call the program's, as code of the processor: qsort, and newlib's streams,
 * which reach files through a table that the program has set. xtensa_programs/romcode.py compiles it into
 * code.h. */

typedef unsigned size_t;

/* No loop of it may become a call of strlen() or memset(): those have another address on each chip. */
#if __has_attribute(no_builtin)
#define PLAIN __attribute__((no_builtin))
#else
#define PLAIN
#endif

/* ---- sorting: by insertion ---- */

PLAIN void rom_qsort(unsigned char *base, size_t count, size_t size,
                     int (*compare)(const void *, const void *)) {
    unsigned char *end = base + count * size;
    for (unsigned char *from = base + size; from < end; from += size)
        for (unsigned char *at = from; at > base && compare(at - size, at) > 0; at -= size)
            for (size_t i = 0; i < size; i++) {
                const unsigned char other = at[i];
                at[i] = (at - size)[i];
                (at - size)[i] = other;
            }
}

/* ---- ESP-IDF's table of system calls: libc_stubs.h ---- */

struct reent;
struct calls {
    struct reent *(*getreent)(void);
    void *(*malloc_r)(struct reent *, size_t);
    void *others[17];
    int (*close_r)(struct reent *, int);
    int (*open_r)(struct reent *, const char *, int, int);
    int (*write_r)(struct reent *, int, const void *, int);
    int (*lseek_r)(struct reent *, int, int, int);
    int (*read_r)(struct reent *, int, void *, int);
    void (*lock_init)(int *);
    void (*lock_init_recursive)(int *);
};

/* The last word of this code has the place where the chip's programs put the pointer to theirs. */
#define CALLS (**(struct calls ***)0x4006FFFC)

int rom_read(int file, void *to, int count) {
    return CALLS->read_r(CALLS->getreent(), file, to, count);
}

int rom_write(int file, const void *from, int count) {
    return CALLS->write_r(CALLS->getreent(), file, from, count);
}

int rom_open(const char *path, int flags, int mode) {
    return CALLS->open_r(CALLS->getreent(), path, flags, mode);
}

int rom_close(int file) {
    return CALLS->close_r(CALLS->getreent(), file);
}

PLAIN char *rom_strdup(const char *text) {
    size_t size = 1;
    while (text[size - 1] != '\0')
        size++;
    char *copy = CALLS->malloc_r(CALLS->getreent(), size);
    for (size_t i = 0; copy != 0 && i < size; i++)
        copy[i] = text[i];
    return copy;
}

/* strtok_r and strsep, which the last argument tells apart. */
PLAIN char *rom_token(char *text, const char *ends, char **rest, int skips) {
    char *at = text != 0 ? text : *rest;
    if (at == 0)
        return 0;
    if (skips) {
        for (const char *end = ends; *end != '\0'; end++)
            if (*at == *end) {
                at++;
                end = ends - 1;
            }
        if (*at == '\0') {
            *rest = 0;
            return 0;
        }
    }
    char *begin = at;
    for (; *at != '\0'; at++)
        for (const char *end = ends; *end != '\0'; end++)
            if (*at == *end) {
                *at = '\0';
                *rest = at + 1;
                return begin;
            }
    *rest = 0;
    return begin;
}

char *rom_strtok_r(char *text, const char *ends, char **rest) {
    return rom_token(text, ends, rest, 1);
}

/* ---- streams: newlib's FILE, as far as these functions see it ---- */

struct file {
    unsigned char *at;
    int left, room;
    short flags, number;
    unsigned char *base;
    int size, line_size;
    struct reent *owner;
    void *cookie;
    int (*read)(struct reent *, void *, char *, int);
    int (*write)(struct reent *, void *, const char *, int);
    int (*seek)(struct reent *, void *, int, int);
    int (*close)(struct reent *, void *);
    unsigned others[9];
    int lock;
    unsigned state[2];
    int flags2;
};
enum { LINE_BUFFERED = 1, UNBUFFERED = 2, WRITES = 8, FAILED = 0x40, FREE = 0, RESERVED = 1, FILES = 8 };

/* Between the flash chip's description and what Bluetooth would have. */
#define POOL ((struct file *)0x3FFAE300)

PLAIN struct file *rom_sfp(struct reent *owner) {
    for (int i = 0; i < FILES; i++) {
        struct file *file = &POOL[i];
        if (file->flags != FREE)
            continue;
        unsigned *word = (unsigned *)file;
        for (unsigned n = 0; n < sizeof *file / 4; n++)
            word[n] = 0;
        file->flags = RESERVED;
        file->number = -1;
        file->owner = owner;
        CALLS->lock_init_recursive(&file->lock);
        return file;
    }
    *(int *)owner = 12; /* ENOMEM */
    return 0;
}

int rom_swrite(struct reent *owner, void *cookie, const char *from, int count) {
    return CALLS->write_r(owner, ((struct file *)cookie)->number, from, count);
}

int rom_sread(struct reent *owner, void *cookie, char *to, int count) {
    return CALLS->read_r(owner, ((struct file *)cookie)->number, to, count);
}

int rom_sseek(struct reent *owner, void *cookie, int offset, int whence) {
    return CALLS->lseek_r(owner, ((struct file *)cookie)->number, offset, whence);
}

int rom_sclose(struct reent *owner, void *cookie) {
    return CALLS->close_r(owner, ((struct file *)cookie)->number);
}

/* __sflush_r, _fflush_r: what waits to be written. */
int rom_flush(struct reent *owner, struct file *file) {
    if (file == 0 || (file->flags & WRITES) == 0 || file->base == 0)
        return 0;
    const char *from = (const char *)file->base;
    int count = (int)(file->at - file->base);
    file->at = file->base;
    file->room = (file->flags & (LINE_BUFFERED | UNBUFFERED)) != 0 ? 0 : file->size;
    while (count > 0) {
        const int done = file->write(owner, file->cookie, from, count);
        if (done <= 0) {
            file->flags |= FAILED;
            return -1;
        }
        from += done;
        count -= done;
    }
    return 0;
}
