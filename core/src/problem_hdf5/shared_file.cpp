// SPDX-License-Identifier: BSD-3-Clause
#include "problem_hdf5/shared_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "delassus/error.hpp"
#include "support/call_in_child.hpp"
#include "support/output_folder.hpp"

namespace delassus::problem_hdf5 {

using hdf5::Handle;
using hdf5::last_complaint;

Writing::Writing(const std::filesystem::path& file, bool create, std::string target) : target_(std::move(target)) {
    const Handle access(H5Pcreate(H5P_FILE_ACCESS));
    H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
    file_ = create ? H5Fcreate(file.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, access.get())
                   : H5Fopen(file.c_str(), H5F_ACC_RDWR, access.get());
    if (file_ < 0)
        throw InputError(
            fmt::format("{} cannot be {} ({}).", target_, create ? "created" : "written", last_complaint()));
    if (create) text("writer", std::string(file_mark));
}

Writing::~Writing() {
    if (file_ >= 0) H5Fclose(file_);
}

void Writing::close() {
    const hid_t file = std::exchange(file_, H5I_INVALID_HID);
    check(H5Fclose(file) >= 0);
}

void Writing::check(bool good) const {
    if (!good) throw InputError(fmt::format("{} cannot be written ({}).", target_, last_complaint()));
}

namespace {

Handle text_type(const std::string& value) {
    Handle type(H5Tcopy(H5T_C_S1));
    H5Tset_size(type.get(), std::max<std::size_t>(1, value.size()));
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
    return type;
}

}  // namespace

void Writing::text(const char* name, const std::string& value) {
    constexpr std::size_t longest_attribute = 60'000;  // 64 KiB with its header
    if (value.empty()) return;
    const std::string kept = value.substr(0, longest_attribute);
    const Handle type = text_type(kept), space(H5Screate(H5S_SCALAR));
    const Handle attribute(H5Acreate2(file_, name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT));
    check(attribute.valid() && H5Awrite(attribute.get(), type.get(), kept.data()) >= 0);
}

void Writing::integer(const char* name, std::int64_t value) {
    const Handle space(H5Screate(H5S_SCALAR));
    const Handle attribute(H5Acreate2(file_, name, H5T_STD_I64LE, space.get(), H5P_DEFAULT, H5P_DEFAULT));
    check(attribute.valid() && H5Awrite(attribute.get(), H5T_NATIVE_INT64, &value) >= 0);
}

void Writing::long_text(const char* name, const std::string& value) {
    if (value.empty()) return;
    const Handle type = text_type(value), space(H5Screate(H5S_SCALAR));
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE));
    H5Pset_obj_track_times(creation.get(), false);
    const Handle set(H5Dcreate2(file_, name, type.get(), space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT));
    check(set.valid() && H5Dwrite(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, value.data()) >= 0);
    bytes_ += static_cast<std::int64_t>(value.size());
}

void Writing::group(const char* name) {
    const Handle creation(H5Pcreate(H5P_GROUP_CREATE));
    H5Pset_obj_track_times(creation.get(), false);
    const Handle made(H5Gcreate2(file_, name, H5P_DEFAULT, creation.get(), H5P_DEFAULT));
    check(made.valid());
}

void Writing::create(const char* name, hid_t type, std::int64_t count) {
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE));
    H5Pset_alloc_time(creation.get(), H5D_ALLOC_TIME_EARLY);
    H5Pset_fill_time(creation.get(), H5D_FILL_TIME_NEVER);
    H5Pset_obj_track_times(creation.get(), false);  // equal content, equal bytes
    const auto size = static_cast<hsize_t>(count);
    const Handle space(H5Screate_simple(1, &size, nullptr));
    const Handle set(H5Dcreate2(file_, name, type, space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT));
    check(set.valid());
}

void Writing::put(const char* name, std::int64_t first, std::span<const std::int64_t> values) {
    put(name, first, values.size(), H5T_NATIVE_INT64, values.data());
}

void Writing::put(const char* name, std::int64_t first, std::span<const double> values) {
    put(name, first, values.size(), H5T_NATIVE_DOUBLE, values.data());
}

void Writing::put(const char* name, std::int64_t first, std::size_t count, hid_t type, const void* values) {
    if (count == 0) return;
    const hsize_t start = static_cast<hsize_t>(first), block = count;
    const Handle set(H5Dopen2(file_, name, H5P_DEFAULT));
    const Handle space(H5Dget_space(set.get())), memory(H5Screate_simple(1, &block, nullptr)),
        stored(H5Dget_type(set.get()));
    check(set.valid() && H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, &start, nullptr, &block, nullptr) >= 0 &&
          H5Dwrite(set.get(), type, memory.get(), space.get(), H5P_DEFAULT, values) >= 0);
    bytes_ += static_cast<std::int64_t>(count * H5Tget_size(stored.get()));
}

namespace {

/// Gives the file its blocks on disk, so that a full disk shows before anything is written.
void reserve(const std::filesystem::path& file, const std::string& target) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    const int descriptor = open(file.c_str(), O_RDWR | O_CLOEXEC);
    if (error || bytes == 0 || descriptor < 0) {
        if (descriptor >= 0) ::close(descriptor);
        return;
    }
    const int failure = fallocate(descriptor, 0, 0, static_cast<off_t>(bytes)) == 0 ? 0 : errno;
    ::close(descriptor);
    if (failure == 0 || failure == EOPNOTSUPP || failure == ENOSYS) return;  // not every file system can
    throw InputError(fmt::format("{} cannot be written: {}.", target, std::strerror(failure)));
}

}  // namespace

void write_in_turn(const Communicator& communicator, const std::filesystem::path& path,
                   const std::function<void(Writing&)>& lay_out, const std::function<void(Writing&)>& write_own,
                   FileTraffic& traffic) {
    const hdf5::Silence silence;
    const int rank = communicator.rank();
    std::optional<AtomicFile> target;
    std::string name;
    // A child, because HDF5 crashes at the end of a process in which it could not write.
    const auto write = [&](bool create, const std::function<void(Writing&)>& content) {
        traffic.bytes_written += write_in_child(path, "HDF5", [&] {
            hdf5::require_memory();
            Writing file(name, create, path.string());
            content(file);
            file.close();
            return file.bytes();
        });
    };
    together(communicator, [&] {
        if (rank != 0) return;
        require_replaceable(path, "");
        target.emplace(path);
        name = target->path().string();
        write(true, lay_out);
        reserve(name, path.string());
    });
    name = communicator.broadcast(name);
    for (int turn = 0; turn < communicator.size(); ++turn) {
        together(communicator, [&] {
            if (rank == turn) write(false, write_own);
        });
    }
    together(communicator, [&] {
        if (rank == 0) target->commit();
    });
}

}  // namespace delassus::problem_hdf5
