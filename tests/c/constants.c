/* Reads cameras from standard input, writes the constants that limpid.h makes of them to standard output. */
#include <stdio.h>

#include "limpid.h"

typedef struct Record {
    LimpidInputs inputs;
    LimpidPrevious previous;
    uint32_t has_previous;
} Record;

int main(void) {
    const LimpidSettings settings = limpid_settings();
    Record record;
    uint32_t extent[2], grid[3];
    limpid_extent(&limpid_resources[LIMPID_RESOURCE_TILES], 1920, 1080, extent);
    limpid_grid(&limpid_passes[LIMPID_PASS_CLASSIFY], 1920, 1080, grid);
    if (extent[0] != 240 || extent[1] != 135 || grid[0] != 60 || grid[1] != 34 || grid[2] != 1) {
        return 3;
    }
    limpid_extent(&limpid_resources[LIMPID_RESOURCE_BLOCKS], 1921, 1080, extent);
    limpid_grid(&limpid_passes[LIMPID_PASS_LIST_TILES], 1921, 1080, grid);
    if (extent[0] != 481 || extent[1] != 270 || grid[0] != 31 || grid[1] != 17 || grid[2] != 1) {
        return 4;
    }
    while (fread(&record, sizeof record, 1, stdin) == 1) {
        LimpidFrame frame;
        const LimpidPrevious *previous = record.has_previous ? &record.previous : NULL;
        const char *problem = limpid_fill_constants(&settings, &record.inputs, previous, &frame);
        if (problem != NULL) {
            fprintf(stderr, "%s\n", problem);
            memset(&frame, 0, sizeof frame);
        }
        fwrite(&frame, sizeof frame, 1, stdout);
    }
    return 0;
}
