#pragma once
/// OFFSTAGE_UNFUSED before a function: it gives the same bits in every build. GCC 12's vectorizer of
/// straight-line code can fuse products and sums (vfmaddsub) in spite of -ffp-contract=off.

#if defined(__GNUC__) && !defined(__clang__)
#define OFFSTAGE_UNFUSED [[gnu::optimize("no-tree-slp-vectorize")]]
#else
#define OFFSTAGE_UNFUSED
#endif
