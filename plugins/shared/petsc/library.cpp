// SPDX-License-Identifier: BSD-3-Clause
#include "library.hpp"

#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace delassus::petsc {

namespace {

std::recursive_mutex& library() {
    static std::recursive_mutex mutex;
    return mutex;
}

pid_t& owner() {
    static pid_t process = 0;
    return process;
}

std::string& message() {
    thread_local std::string text;
    return text;
}

// PETSc calls this at every level that an error passes through; the first knows what happened.
PetscErrorCode keep_message(MPI_Comm, int, const char* function, const char*, PetscErrorCode code, PetscErrorType type,
                            const char* text, void*) {
    if (type == PETSC_ERROR_INITIAL) {
        message() = text ? text : "";
        if (function) message() += " (" + std::string(function) + ")";
    }
    return code;
}

void finalize_at_exit() {
    if (owner() == getpid() && petsc_is_running()) PetscFinalize();
}

}  // namespace

void ensure_petsc() {
    const std::lock_guard lock(library());
    sdk::ensure_mpi();
    PetscBool done = PETSC_FALSE;
    PetscFinalized(&done);
    if (done) throw std::runtime_error("PETSc has been finalised in this process and cannot be started again");
    PetscInitialized(&done);
    if (done) return;
    // PETSc keeps the pointers for its whole life.
    static char name[] = "delassus", no_file[] = "-skip_petscrc", no_signals[] = "-no_signal_handler";
    static char* arguments[] = {name, no_file, no_signals, nullptr};
    static int count = 3;
    static char** values = arguments;
    if (PetscInitialize(&count, &values, nullptr, nullptr) != 0) throw std::runtime_error("PETSc could not be started");
    owner() = getpid();
    std::atexit(&finalize_at_exit);
}

bool petsc_is_running() {
    PetscBool initialized = PETSC_FALSE, finalized = PETSC_FALSE;
    PetscInitialized(&initialized);
    PetscFinalized(&finalized);
    return initialized && !finalized && sdk::mpi_is_running();
}

Session::Session() : lock_(library()) {
    if (petsc_is_running()) PetscPushErrorHandler(&keep_message, nullptr);
}

Session::~Session() {
    if (petsc_is_running()) PetscPopErrorHandler();
}

void check(PetscErrorCode code) {
    if (code == 0) return;
    std::string text = std::exchange(message(), {});
    if (text.empty()) text = "error " + std::to_string(code);
    throw std::runtime_error("PETSc: " + text);
}

}  // namespace delassus::petsc
