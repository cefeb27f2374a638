// SPDX-License-Identifier: BSD-3-Clause
// PETSc's start and end, its errors as exceptions, its objects as owners.
#pragma once

#include <petscksp.h>

#include <mutex>
#include <utility>

#include "delassus/sdk/mpi.hpp"

namespace delassus::petsc {

/// Starts MPI and PETSc unless they run; PetscFinalize is registered with atexit, before MPI's end. PETSc gets no
/// signal handlers, no argument of the host and no .petscrc; the environment variable PETSC_OPTIONS is honoured.
void ensure_petsc();

/// False after PETSc's or MPI's end: objects are then left alone.
[[nodiscard]] bool petsc_is_running();

/// Held while PETSc is used: one thread at a time in a process, PETSc errors kept as text, nothing printed.
class Session {
public:
    Session();
    ~Session();
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

private:
    std::unique_lock<std::recursive_mutex> lock_;
};

/// Throws std::runtime_error with PETSc's own message unless code is 0.
void check(PetscErrorCode code);

/// Owns a PETSc object. Destroy: VecDestroy and its like.
template <class Object, PetscErrorCode (*Destroy)(Object*)>
class Handle {
public:
    Handle() = default;
    ~Handle() { reset(); }
    Handle(Handle&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
    Handle& operator=(Handle&& other) noexcept {
        if (this != &other) {
            reset();
            object_ = std::exchange(other.object_, nullptr);
        }
        return *this;
    }
    [[nodiscard]] Object get() const { return object_; }
    /// For a PETSc function that makes the object.
    [[nodiscard]] Object* make() {
        reset();
        return &object_;
    }
    void reset() {
        if (object_ && petsc_is_running()) Destroy(&object_);
        object_ = nullptr;
    }

private:
    Object object_ = nullptr;
};

using VectorHandle = Handle<Vec, &VecDestroy>;
using MatrixHandle = Handle<Mat, &MatDestroy>;
using ScatterHandle = Handle<VecScatter, &VecScatterDestroy>;
using IndexHandle = Handle<IS, &ISDestroy>;
using KrylovHandle = Handle<KSP, &KSPDestroy>;

}  // namespace delassus::petsc
