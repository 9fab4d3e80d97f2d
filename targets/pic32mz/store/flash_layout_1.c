/* SPDX-License-Identifier: MIT
 * Pages of layout 1: see flash_page.h. */
#include "store/flash_page.h"

#define PAGE_MAGIC 0x31474657u /* "WFG1" */
#define SEAL_MAGIC 0x5EA1ED00u

bool flash_1_is_page(const struct flash_store *store, unsigned page) {
    return flash_word(store, page, 0, 0) == PAGE_MAGIC &&
           flash_word(store, page, 0, 1) == ~flash_word(store, page, 0, 2);
}

/* A record that was written completely begins here. Its value is for the core to check. */
static bool is_sealed(const struct flash_store *store, unsigned page, unsigned unit, uint32_t count) {
    unsigned seal = unit + 1 + flash_value_units(count);
    return flash_word(store, page, seal, 0) == SEAL_MAGIC &&
           flash_word(store, page, seal, 1) == flash_word(store, page, unit, 2);
}

/* What is not a record is passed over: power cuts have left some in the middle of a page. */
void flash_1_find(const struct flash_store *store, unsigned page, struct flash_record found[FLASH_KEYS]) {
    for (unsigned unit = 1; unit < FLASH_UNITS;) {
        uint32_t mark = flash_word(store, page, unit, 0), count = flash_word(store, page, unit, 1);
        bool is_record = (mark & ~0xFFu) == FLASH_RECORD_MAGIC && (mark & 0xFFu) < FLASH_KEYS &&
                         count <= FLASH_VALUE_MAX && unit + flash_record_units(count) <= FLASH_UNITS &&
                         is_sealed(store, page, unit, count);
        if (is_record)
            found[mark & 0xFFu] = (struct flash_record){.kind = FLASH_KIND_RECORD,
                                                        .page = page,
                                                        .unit = unit,
                                                        .label = {.key = mark & 0xFFu, .count = count}};
        unit += is_record ? flash_record_units(count) : 1;
    }
}
