enum { LIMPID_CONSTANTS, LIMPID_INPUT, LIMPID_TEXTURE, LIMPID_BUFFER };
enum { LIMPID_EXTERNAL, LIMPID_PERSISTENT, LIMPID_TRANSIENT };
enum { LIMPID_EXTENT_FULL, LIMPID_EXTENT_BLOCK, LIMPID_EXTENT_TILE };
enum { LIMPID_READ, LIMPID_WRITE, LIMPID_READ_WRITE };
enum { LIMPID_STAGE_CLASSIFY, LIMPID_STAGE_DENOISE };
enum { LIMPID_GRID_ONE, LIMPID_GRID_SQUARES, LIMPID_GRID_INDIRECT };

typedef struct LimpidResource {
    const char *name;
    int kind;            /* LIMPID_CONSTANTS ... */
    int lifetime;        /* LIMPID_EXTERNAL: yours; PERSISTENT: kept, zero at first; TRANSIENT: within a frame */
    int extent;          /* LIMPID_EXTENT_: a texel or element for each pixel, 4x4 block or 8x8 tile */
    uint32_t copies;     /* 2: in frame n the current copy is n % 2 */
    const char *format;  /* as WebGPU names it; manifest.json has the other names */
    uint32_t stride;     /* bytes of a texel or element */
    uint32_t count;      /* elements, if not 0: then `extent` means nothing */
} LimpidResource;

typedef struct LimpidBinding {
    const char *variable;
    int resource;        /* LIMPID_RESOURCE_ */
    int previous;        /* 1: last frame's copy */
    int access;          /* LIMPID_READ ... */
    uint32_t group;      /* register space or descriptor set, unless options moved it: see manifest.json */
    uint32_t binding;    /* register or binding */
} LimpidBinding;

typedef struct LimpidPass {
    const char *name;    /* of file and entry point */
    int stage;           /* before or after the renderer traces rays */
    int grid;            /* LIMPID_GRID_: one workgroup, one for each square of the frame, or indirect */
    uint32_t grid_side;  /* pixels of the side of a square */
    int grid_resource;   /* buffer with the grid */
    uint32_t grid_offset;
    int barrier;         /* 1: needs a barrier on all memory before it */
    const LimpidBinding *bindings;
    uint32_t binding_count;
} LimpidPass;

/* Squares of `side` pixels that cover so many pixels in one direction. */
static inline uint32_t limpid_squares(uint32_t pixels, uint32_t side) {
    return (pixels + side - 1u) / side;
}

/* Texels or elements of a resource in x and y, for images of up to width x height pixels. */
static inline void limpid_extent(const LimpidResource *resource, uint32_t width, uint32_t height, uint32_t out[2]) {
    const uint32_t side = resource->extent == LIMPID_EXTENT_TILE    ? LIMPID_TILE_SIZE
                          : resource->extent == LIMPID_EXTENT_BLOCK ? LIMPID_BLOCK_SIZE
                                                                    : 1u;
    out[0] = resource->count != 0 ? resource->count : limpid_squares(width, side);
    out[1] = resource->count != 0 ? 1u : limpid_squares(height, side);
}

/* Workgroups of a pass that is not indirect, for a frame of width x height pixels. */
static inline void limpid_grid(const LimpidPass *pass, uint32_t width, uint32_t height, uint32_t out[3]) {
    const int is_one = pass->grid == LIMPID_GRID_ONE;
    out[0] = is_one ? 1u : limpid_squares(width, pass->grid_side);
    out[1] = is_one ? 1u : limpid_squares(height, pass->grid_side);
    out[2] = 1u;
}
