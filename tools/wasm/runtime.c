// What the compiled functions need of numba's runtime (NRT), of the C library and of LLVM's, on
// wasm32, and the functions that the module exports.
//
// Memory: data and stack, then the arrays of the caller (reserve), then numba's own arrays. Of
// these each has a block of 64 << n bytes; a block that is free is in a list of its size.

typedef unsigned char u8;
typedef unsigned int u32;
typedef unsigned long long u64;
typedef long long i64;

enum { SMALLEST = 64, SIZES = 26 };

// NRT's MemInfo, with the 64-bit words of numba and the 32-bit pointers of the target.
typedef struct {
  i64 count;
  u32 destroy, destroy_argument;
  u32 data, size_class;  // a list of numba moves its data to a larger block
  i64 size;
} MemInfo;

extern u8 __heap_base;
static u32 end;           // of the arrays of the caller and all blocks
static u32 free_[SIZES];  // the first free block of each size; each has the address of the next

static u32 first_free(void) { return ((u32)&__heap_base + 63) & ~63u; }

// Take memory at the end; an engine that has no more of it stops here.
static u32 extend(u64 bytes) {
  u32 at = end ? end : first_free();
  u64 until = (at + bytes + 63) & ~63ull;
  u64 have = (u64)__builtin_wasm_memory_size(0) << 16;
  if (until >> 32) __builtin_trap();
  if (until > have) {
    u32 pages = (u32)((until - have + 65535) >> 16);
    if (__builtin_wasm_memory_grow(0, pages) == (u32)-1) __builtin_trap();
  }
  end = (u32)until;
  return at;
}

static u32 take(u64 bytes, u32 *size_class) {
  u32 n = 0;
  while (((u64)SMALLEST << n) < bytes) n++;
  if (n >= SIZES) __builtin_trap();
  *size_class = n;
  u32 block = free_[n];
  if (!block) return extend((u64)SMALLEST << n);
  free_[n] = *(u32 *)block;
  return block;
}

static void give(u32 block, u32 size_class) {
  *(u32 *)block = free_[size_class];
  free_[size_class] = block;
}

// The MemInfo is in a block of its own, so that data keep their alignment.
static MemInfo *allocate(i64 size) {
  u32 unused;
  MemInfo *info = (MemInfo *)take(sizeof(MemInfo), &unused);
  info->count = 1;
  info->destroy = info->destroy_argument = 0;
  info->size = size;
  info->data = take((u64)size, &info->size_class);
  return info;
}

void *NRT_MemInfo_alloc_aligned(i64 size, u32 align) { return allocate(size); }
void *NRT_MemInfo_alloc_safe_aligned(i64 size, u32 align) { return allocate(size); }
void *NRT_MemInfo_alloc(i64 size) { return allocate(size); }
void *NRT_MemInfo_new_varsize(i64 size) { return allocate(size); }

// The items of lists are numbers, so there is nothing to destroy with a list.
void *NRT_MemInfo_new_varsize_dtor(i64 size, void *destroy) { return allocate(size); }

void *NRT_MemInfo_varsize_realloc(MemInfo *info, i64 size) {
  u32 size_class, data = take((u64)size, &size_class);
  i64 kept = info->size < size ? info->size : size;
  __builtin_memcpy((void *)data, (void *)info->data, (u32)kept);
  give(info->data, info->size_class);
  info->data = data;
  info->size_class = size_class;
  info->size = size;
  return (void *)data;
}

void NRT_MemInfo_varsize_free(MemInfo *info, void *data) {
  give(info->data, info->size_class);
  info->data = 0;
}

void NRT_incref(MemInfo *info) {
  if (info) info->count++;
}

void NRT_decref(MemInfo *info) {
  if (!info || --info->count > 0) return;
  if (info->data) give(info->data, info->size_class);
  give((u32)info, 0);
}

// The strides of an array in a new shape. Arrays that take another shape lie in one piece.
int numba_attempt_nocopy_reshape(
    i64 axes, const i64 *sizes, const i64 *strides, i64 new_axes, const i64 *new_sizes,
    i64 *new_strides, i64 item, int is_fortran) {
  for (i64 axis = new_axes - 1; axis >= 0; axis--) {
    new_strides[axis] = item;
    item *= new_sizes[axis];
  }
  return 1;
}

// 64 x 64 -> 128 bits: LLVM divides by constants with it.
typedef unsigned __int128 u128;
u128 __multi3(u128 x, u128 y) {
  u64 a = (u64)x, b = (u64)y, al = (u32)a, ah = a >> 32, bl = (u32)b, bh = b >> 32;
  u64 ll = al * bl, lh = al * bh, hl = ah * bl, hh = ah * bh;
  u64 middle = (ll >> 32) + (u32)lh + (u32)hl;
  u64 low = (middle << 32) | (u32)ll;
  u64 high = hh + (lh >> 32) + (hl >> 32) + (middle >> 32);
  high += (u64)(x >> 64) * b + a * (u64)(y >> 64);
  return ((u128)high << 64) | low;
}

void *memset(void *to, int value, u32 size) {
  __builtin_memset(to, value, size);
  return to;
}
void *memcpy(void *to, const void *from, u32 size) {
  __builtin_memcpy(to, from, size);
  return to;
}
void *memmove(void *to, const void *from, u32 size) {
  __builtin_memmove(to, from, size);
  return to;
}

// The exports, with arguments that JavaScript has without BigInt.

// Where the caller writes the table of its arrays.
i64 table[96 * 5];
i64 *arrays(void) { return table; }

// Reserve memory for an array, filled with zeros; before the first call of what follows.
u32 reserve(double bytes) {
  u32 at = extend((u64)bytes);
  __builtin_memset((void *)at, 0, end - at);
  return at;
}

// Forget all arrays, so that those of another scenario can be laid out.
void forget(void) {
  end = first_free();
  __builtin_memset(free_, 0, sizeof(free_));
}

// A compiled function returns other than 0 for an exception, which none of them raises.
#define CALL(name, ...) \
  if (dess_##name(&result, &error, table, ##__VA_ARGS__)) __builtin_trap()

int dess_prepare(void *, void **, i64 *);
int dess_play(void *, void **, i64 *, i64, i64, u8, i64);
int dess_measure(void *, void **, i64 *, i64);
int dess_subtract(void *, void **, i64 *, i64);
int dess_begin(void *, void **, i64 *, u8);
int dess_add(void *, void **, i64 *, i64);

static i64 result;
static void *error;

// Fill the tables that follow from the sea; after the arrays have been written.
void prepare(void) { CALL(prepare); }

// Fly missions to their ends; how many of them are over.
u32 play(double first, u32 count) {
  CALL(play, (i64)first, count, 1, (i64)1 << 62);
  return (u32)result;
}

// Begin a mission, whose slots advance simulates.
void launch(double replication) { CALL(play, (i64)replication, 1, 1, 0); }

// Fly the mission that was launched for so many slots; 1 if it is over, and has its record.
u32 advance(double slots) {
  CALL(play, 0, 1, 0, (i64)slots);
  return (u32)result;
}

// The metrics of the missions of the last call of play, into values.
void measure(u32 count) { CALL(measure, count); }

// Take so many rows of baseline from those of values.
void subtract(u32 count) { CALL(subtract, count); }

// Begin totals and sequences, of metrics (0) or of differences (1).
void begin(u32 is_difference) { CALL(begin, is_difference != 0); }

// Add so many rows of values to totals and sequences.
void add(u32 count) { CALL(add, count); }
