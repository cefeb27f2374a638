// SPDX-License-Identifier: BSD-3-Clause
// MPI for plugins that need it: started when a solver is created, never when a library is loaded, ended once, at exit.
// Several plugins in one process share one MPI. Only plugins that link MPI include this header.
//
// Every process of a run holds the whole problem and must end with the same x and λ; all of them call the same
// operations in the same order. Whatever could differ between them (clocks, above all) is settled by agree().
#pragma once

#include <mpi.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>

#include "delassus/sdk/solver.hpp"

namespace delassus::sdk {

/// Whether MPI can be called now: it has been started and not been ended.
inline bool mpi_is_running() {
    int initialized = 0, finalized = 0;
    MPI_Initialized(&initialized);
    MPI_Finalized(&finalized);
    return initialized != 0 && finalized == 0;
}

namespace mpi_detail {

// Open MPI 5's session folder of a process of its own, with nothing of anybody else's in it; empty if there is none.
inline std::string& session_folder() {
    static std::string folder;
    return folder;
}

// A process that no launcher started needs none of Open MPI's networks, nor its daemon. Looking for them takes most
// of a second (measured: 0.30 s against 0.025 s for start and end), so they are left out by default; what the user
// has set stays. It needs no session folder either, a place for files that processes of one run share: all processes of
// a user have it below the same folder, which the last to end removes, and one that starts at that moment fails
// ("orte_session_dir failed") and ends its program. Open MPI 5 makes one in any case, in TMPDIR, leaves it, and crashes
// where it cannot: it is given a folder of this process alone, removed at the end. The settings are taken back after
// the start, since children of this process (an mpirun, say) would inherit them. Other MPIs ignore these names.
class SingletonEnvironment {
public:
    SingletonEnvironment() {
        for (const char* launched : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_FD", "PMI_SIZE"})
            if (std::getenv(launched)) return;
#if defined(OMPI_MAJOR_VERSION) && OMPI_MAJOR_VERSION >= 5
        if (const char* named = std::getenv("TMPDIR")) {
            has_temporary_ = true;
            temporary_ = named;
        }
        std::error_code failed;
        std::string folder = (std::filesystem::temp_directory_path(failed) / "delassus-mpi-XXXXXX").string();
        if (failed) folder = "/tmp/delassus-mpi-XXXXXX";
        if (!mkdtemp(folder.data())) throw std::runtime_error("MPI needs a folder for temporary files: set TMPDIR");
        session_folder() = folder;
        setenv("TMPDIR", folder.c_str(), 1);
#endif
        for (std::size_t k = 0; k < defaults.size(); ++k) {
            if (std::getenv(defaults[k][0])) continue;
            setenv(defaults[k][0], defaults[k][1], 0);
            set_[k] = true;
        }
    }
    ~SingletonEnvironment() {
        if (has_temporary_)
            setenv("TMPDIR", temporary_.c_str(), 1);
        else if (!session_folder().empty())
            unsetenv("TMPDIR");
        for (std::size_t k = 0; k < defaults.size(); ++k)
            if (set_[k]) unsetenv(defaults[k][0]);
    }
    SingletonEnvironment(const SingletonEnvironment&) = delete;
    SingletonEnvironment& operator=(const SingletonEnvironment&) = delete;

private:
    static constexpr std::array<std::array<const char*, 2>, 6> defaults = {{
        {"OMPI_MCA_ess_singleton_isolated", "1"},  // no daemon is forked
        {"OMPI_MCA_orte_create_session_dirs", "0"},
        {"OMPI_MCA_btl", "self"},
        {"OMPI_MCA_pml", "ob1"},
        {"OMPI_MCA_mtl", "^ofi,psm2,psm"},
        {"PMIX_MCA_gds", "hash"},  // no shared-memory files
    }};
    std::array<bool, defaults.size()> set_{};
    bool has_temporary_ = false;
    std::string temporary_;  // TMPDIR as the user has it, while another is set
};

inline pid_t& owner() {
    static pid_t process = 0;
    return process;
}

// Runs at exit. A forked child inherits the registration but owns no MPI.
inline void finalize_at_exit() {
    if (owner() != getpid()) return;
    if (mpi_is_running()) MPI_Finalize();
    std::error_code ignored;
    if (!session_folder().empty()) std::filesystem::remove_all(session_folder(), ignored);
}

}  // namespace mpi_detail

/// Starts MPI unless it runs already; whoever started it ends it, here by a function registered with atexit.
/// A library with an end of its own (PetscFinalize) registers that after this call, so that it runs before.
/// Throws std::runtime_error if MPI cannot be used any more. Call it from a solver's constructor.
inline void ensure_mpi() {
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    int initialized = 0, finalized = 0;
    MPI_Initialized(&initialized);
    MPI_Finalized(&finalized);
    if (finalized) throw std::runtime_error("MPI has been finalised in this process and cannot be started again");
    if (initialized) return;
    const mpi_detail::SingletonEnvironment environment;
    int provided = 0;
    if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_MULTIPLE, &provided) != MPI_SUCCESS)
        throw std::runtime_error("MPI could not be started");
    mpi_detail::owner() = getpid();
    std::atexit(&mpi_detail::finalize_at_exit);
}

/// A communicator of one solver over all processes, so that messages of two solvers cannot meet. Starts MPI.
/// Making and destroying one is collective; destroying it after the end of MPI is safe.
class MpiCommunicator {
public:
    MpiCommunicator() {
        ensure_mpi();
        MPI_Comm_dup(MPI_COMM_WORLD, &communicator_);
        MPI_Comm_rank(communicator_, &rank_);
        MPI_Comm_size(communicator_, &size_);
    }
    ~MpiCommunicator() {
        if (mpi_is_running()) MPI_Comm_free(&communicator_);
    }
    MpiCommunicator(const MpiCommunicator&) = delete;
    MpiCommunicator& operator=(const MpiCommunicator&) = delete;

    [[nodiscard]] MPI_Comm get() const { return communicator_; }
    [[nodiscard]] int rank() const { return rank_; }
    [[nodiscard]] int size() const { return size_; }

    /// The largest of the processes' values: one decision for all. Collective.
    [[nodiscard]] int agree(int value) const {
        if (size_ > 1) MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_INT, MPI_MAX, communicator_);
        return value;
    }

    /// What the hosts of all processes together answer to an iterate. Collective.
    [[nodiscard]] delassus_answer progress(const Request& request, std::int64_t iteration, const double* x,
                                           const double* lambda) const {
        return static_cast<delassus_answer>(agree(request.progress(iteration, x, lambda)));
    }

    /// count values of process 0 to all. Collective.
    void broadcast(double* values, std::int64_t count) const {
        constexpr std::int64_t portion = std::int64_t{1} << 30;
        if (size_ == 1) return;
        for (std::int64_t k = 0; k < count; k += portion)
            MPI_Bcast(values + k, static_cast<int>(std::min(portion, count - k)), MPI_DOUBLE, 0, communicator_);
    }

private:
    MPI_Comm communicator_ = MPI_COMM_NULL;
    int rank_ = 0, size_ = 1;
};

}  // namespace delassus::sdk
