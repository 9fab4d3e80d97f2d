/* SPDX-License-Identifier: MIT
 * Random inputs of one harness from seeds, with any compiler: seeds FIRST SECONDS FOLDER. Each runs in a
 * process of its own; what ends badly is written to FOLDER/seed-N, for replay, and the next seed follows. */
#include "fuzz.h"

#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { SIZE_MAX_BYTES = 512, SLOWEST_S = 60 };

static size_t make_input(uint64_t seed, uint8_t data[SIZE_MAX_BYTES]) {
    uint64_t state = seed * 0x9E3779B97F4A7C15u | 1u;
    size_t size = 0;
    for (size_t want = SIZE_MAX_BYTES; size < want; size++) {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        if (size == 0)
            want = 2 + (state >> 40) % (SIZE_MAX_BYTES - 2);
        data[size] = (uint8_t)(state >> 32);
    }
    return size;
}

static bool write_input(const char *folder, uint64_t seed, const uint8_t *data, size_t size) {
    char path[1024];
    snprintf(path, sizeof path, "%s/seed-%llu", folder, (unsigned long long)seed);
    FILE *file = fopen(path, "wb");
    if (file == NULL)
        return false;
    bool good = fwrite(data, 1, size, file) == size;
    return fclose(file) == 0 && good;
}

/* @return whether it ended well */
static bool run(const uint8_t *data, size_t size) {
    int status = 0;
    pid_t child = fork();
    if (child == 0) {
        alarm(SLOWEST_S);
        LLVMFuzzerTestOneInput(data, size);
        _exit(0);
    }
    return child > 0 && waitpid(child, &status, 0) == child && status == 0;
}

int main(int argc, char **argv) {
    static uint8_t data[SIZE_MAX_BYTES];
    if (argc != 4) {
        fprintf(stderr, "seeds FIRST SECONDS FOLDER\n");
        return 2;
    }
    uint64_t seed = strtoull(argv[1], NULL, 10), bad = 0, runs = 0;
    time_t end = time(NULL) + strtol(argv[2], NULL, 10);
    for (; time(NULL) < end; seed++, runs++) {
        size_t size = make_input(seed, data);
        if (run(data, size))
            continue;
        bad++;
        fprintf(stderr, "seed %llu\n", (unsigned long long)seed);
        if (!write_input(argv[3], seed, data, size))
            return 2;
    }
    printf("%llu inputs, %llu findings\n", (unsigned long long)runs, (unsigned long long)bad);
    return bad == 0 ? 0 : 1;
}
