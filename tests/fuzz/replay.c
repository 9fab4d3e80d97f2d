/* SPDX-License-Identifier: MIT
 * Gives each file named to one harness: what libFuzzer does with files, for a compiler that has no libFuzzer.
 */
#include "fuzz.h"

static void replay(const char *path) {
    static uint8_t data[1 << 20];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        perror(path);
        exit(2);
    }
    size_t size = fread(data, 1, sizeof data, file);
    fclose(file);
    uint8_t *exact = malloc(size > 0 ? size : 1);
    if (exact == NULL)
        exit(2);
    for (size_t n = 0; n < size; n++)
        exact[n] = data[n];
    fprintf(stderr, "%s\n", path);
    LLVMFuzzerTestOneInput(exact, size);
    free(exact);
}

int main(int argc, char **argv) {
    for (int n = 1; n < argc; n++)
        replay(argv[n]);
    return 0;
}
