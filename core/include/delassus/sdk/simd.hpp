// SPDX-License-Identifier: BSD-3-Clause
// Short vectors of doubles for inner loops, and the choice of instructions at run time.
//
// A build for plain x86-64 has registers of two doubles. Code written in terms of Quad is compiled twice inside
// with_best_instructions(): for plain x86-64, where a Quad is two registers, and for AVX2, where it is one. The
// operations and their order are the same in both (AVX2 is taken without fused multiply-add), and so are the bits of
// the results.
#pragma once

namespace delassus::sdk {

using Pair = double __attribute__((vector_size(16)));
using Quad = double __attribute__((vector_size(32)));

namespace detail {
// At any address of doubles. (A memcpy of a Quad may go through the stack in two halves, which costs ten times a load.)
using LoosePair = double __attribute__((vector_size(16), aligned(8), may_alias));
using LooseQuad = double __attribute__((vector_size(32), aligned(8), may_alias));
}  // namespace detail

// Quads go by reference: by value their passing would depend on the instructions that the caller is compiled for.

inline void load(const double* from, Pair& to) {
    to = *reinterpret_cast<const detail::LoosePair*>(from);
}
inline void load(const double* from, Quad& to) {
    to = *reinterpret_cast<const detail::LooseQuad*>(from);
}
/// The low half from one place, the high half from another.
inline void load(const double* low, const double* high, Quad& to) {
    Pair first, second;
    load(low, first);
    load(high, second);
    to = __builtin_shufflevector(first, second, 0, 1, 2, 3);
}
inline void store(double* to, const Pair& from) {
    *reinterpret_cast<detail::LoosePair*>(to) = from;
}
inline void store(double* to, const Quad& from) {
    *reinterpret_cast<detail::LooseQuad*>(to) = from;
}
inline void store(double* low, double* high, const Quad& from) {
    store(low, __builtin_shufflevector(from, from, 0, 1));
    store(high, __builtin_shufflevector(from, from, 2, 3));
}
/// (q₀ + q₂) + (q₁ + q₃)
inline double sum(const Quad& quad) {
    const Pair halves = __builtin_shufflevector(quad, quad, 0, 1) + __builtin_shufflevector(quad, quad, 2, 3);
    return halves[0] + halves[1];
}
/// (q₀ + q₂ + p₀) + (q₁ + q₃ + p₁)
inline double sum(const Quad& quad, const Pair& pair) {
    const Pair halves = __builtin_shufflevector(quad, quad, 0, 1) + __builtin_shufflevector(quad, quad, 2, 3) + pair;
    return halves[0] + halves[1];
}

#if defined(__x86_64__)
namespace detail {
template <class Body>
[[gnu::target("avx2"), gnu::flatten]] void with_avx2(const Body& body) {
    body();
}
}  // namespace detail
#endif

/// Calls body(), compiled for the best instructions that this machine has. What body calls is compiled anew only where
/// it can be inlined.
template <class Body>
[[gnu::flatten]] void with_best_instructions(const Body& body) {
#if defined(__x86_64__)
    static const bool has_avx2 = __builtin_cpu_supports("avx2");
    if (has_avx2) {
        detail::with_avx2(body);
        return;
    }
#endif
    body();
}

}  // namespace delassus::sdk
