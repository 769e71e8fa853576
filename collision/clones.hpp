// Plain loops translated twice, for any x86-64 and for one with AVX2; the better one is chosen when the program is
// loaded. Every element does the same operations in the same order in both, so the bits are the same.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__) &&          \
    !defined(__SANITIZE_THREAD__)
#define TROCAR_CLONES __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define TROCAR_CLONES
#endif
