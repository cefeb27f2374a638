// SPDX-License-Identifier: BSD-3-Clause
// The system's BLAS, found at run time: its kernels fit the processor, unlike those of a plugin compiled for all.
#pragma once

#include <dlfcn.h>

#include <array>
#include <string>

#include "delassus/sdk/blas_memory.hpp"

namespace delassus::sdk {

/// Three operations of the C interface to BLAS (32-bit integers), for column-major matrices, and what they come from.
/// The library stays loaded until the process ends. Its threads are its own (OPENBLAS_NUM_THREADS, OMP_NUM_THREADS).
class Blas {
public:
    /// OpenBLAS or BLIS behind the names by which systems install them; null where there is neither, or no memory for
    /// it. The reference BLAS is passed over: Eigen is faster. The first call in a process loads the library, which
    /// takes some milliseconds and, with OpenBLAS, starts its threads.
    static const Blas* find() {
        static const Blas blas;
        return blas.name_.empty() ? nullptr : &blas;
    }

    /// C ← C + alpha A Bᵀ; C rows × columns, A rows × depth, B columns × depth; ld…: their outer strides.
    void add_product(int rows, int columns, int depth, double alpha, const double* A, int lda, const double* B, int ldb,
                     double* C, int ldc) const {
        gemm_(column_major, plain, transposed, rows, columns, depth, alpha, A, lda, B, ldb, 1.0, C, ldc);
    }

    /// The lower triangle of C ← C + alpha A Aᵀ; C size × size, A size × depth.
    void add_square(int size, int depth, double alpha, const double* A, int lda, double* C, int ldc) const {
        syrk_(column_major, lower, plain, size, depth, alpha, A, lda, 1.0, C, ldc);
    }

    /// B ← B L⁻ᵀ; B rows × size, L size × size in its lower triangle.
    void solve_right(int rows, int size, const double* L, int ldl, double* B, int ldb) const {
        trsm_(column_major, right, lower, transposed, no_unit_diagonal, rows, size, 1.0, L, ldl, B, ldb);
    }

    /// The library, its kernels and threads, as far as it says so: "OpenBLAS SkylakeX, 1 thread".
    [[nodiscard]] std::string description() const {
        std::string text = name_;
        if (core_) text += std::string(" ") + core_();
        if (threads_) text += ", " + std::to_string(threads_()) + (threads_() == 1 ? " thread" : " threads");
        return text;
    }

private:
    enum : int {  // of cblas.h
        column_major = 102,
        plain = 111,
        transposed = 112,
        lower = 122,
        no_unit_diagonal = 131,
        right = 142
    };
    using Gemm = void (*)(int, int, int, int, int, int, double, const double*, int, const double*, int, double, double*,
                          int);
    using Syrk = void (*)(int, int, int, int, int, double, const double*, int, double, double*, int);
    using Trsm = void (*)(int, int, int, int, int, int, int, double, const double*, int, double*, int);

    Blas() {
        struct Candidate {
            const char *file, *mark, *name;
        };
        // libblas.so.3 is what the system prefers, and what other libraries of the process have mapped already.
        constexpr std::array<Candidate, 4> candidates{{{"libblas.so.3", "openblas_get_config", "OpenBLAS"},
                                                       {"libblas.so.3", "bli_info_get_version_str", "BLIS"},
                                                       {"libopenblas.so.0", "openblas_get_config", "OpenBLAS"},
                                                       {"libblis.so.4", "bli_info_get_version_str", "BLIS"}}};
        for (const Candidate& candidate : candidates)
            if (take(candidate.file, candidate.mark)) {
                name_ = candidate.name;
                return;
            }
    }

    bool take(const char* file, const char* mark) {
        void* library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
        if (!library) return false;
        gemm_ = reinterpret_cast<Gemm>(dlsym(library, "cblas_dgemm"));
        syrk_ = reinterpret_cast<Syrk>(dlsym(library, "cblas_dsyrk"));
        trsm_ = reinterpret_cast<Trsm>(dlsym(library, "cblas_dtrsm"));
        if (dlsym(library, mark) && gemm_ && syrk_ && trsm_ && openblas_has_memory()) {
            core_ = reinterpret_cast<char* (*)()>(dlsym(library, "openblas_get_corename"));
            threads_ = reinterpret_cast<int (*)()>(dlsym(library, "openblas_get_num_threads"));
            // One thread, until BlasThreads asks for more.
            const auto set = reinterpret_cast<void (*)(int)>(dlsym(library, "openblas_set_num_threads"));
            if (set) set(1);
            return true;
        }
        dlclose(library);
        return false;
    }

    std::string name_;
    Gemm gemm_ = nullptr;
    Syrk syrk_ = nullptr;
    Trsm trsm_ = nullptr;
    char* (*core_)() = nullptr;
    int (*threads_)() = nullptr;
};

}  // namespace delassus::sdk
