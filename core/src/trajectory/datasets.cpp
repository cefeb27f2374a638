// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory/datasets.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "delassus/error.hpp"

namespace delassus::trajectory {

using hdf5::Handle;

namespace {

void describe(hid_t set, const Column& column, const std::string& file) {
    put_text(set, "unit", column.unit, file);
    put_text(set, "description", column.description, file);
}

/// Whether the error number says that there is no room for more.
bool is_full(int failure) {
    return failure == ENOSPC || failure == EDQUOT || failure == EFBIG;
}

[[noreturn]] void fail(const std::string& file) {
    // HDF5 says only that it failed; of the calls that write, the last one left why.
    const int failure = errno;
    const bool known = is_full(failure);
    throw InputError(fmt::format("{}: the trajectory cannot be written{}{}", file, known ? ": " : "",
                                 known ? std::strerror(failure) : ""));
}

/// How a dataset of this size is made that does not grow: with checksums, which only chunks have.
Handle with_checksum(const std::vector<hsize_t>& size, std::size_t element, const std::string& file) {
    constexpr hsize_t largest_chunk = 1 << 30;
    Handle creation = made(H5Pcreate(H5P_DATASET_CREATE), file);
    hsize_t bytes = element;
    for (const auto extent : size) bytes *= extent;
    std::vector<hsize_t> chunk = size;
    chunk[0] = std::clamp<hsize_t>(largest_chunk / std::max<hsize_t>(1, bytes / size[0]), 1, size[0]);
    H5Pset_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data());
    H5Pset_fletcher32(creation.get());
    return creation;
}

void put(hid_t group, const Column& column, hid_t stored, hid_t native, const void* values, std::size_t count,
         const std::vector<hsize_t>& shape, const std::string& file) {
    hsize_t width = 1;
    for (const auto extent : shape) width *= extent;
    if (count == 0 || width == 0) return;
    std::vector<hsize_t> size = {count / width};
    size.insert(size.end(), shape.begin(), shape.end());
    const Handle space = made(H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr), file);
    const Handle creation = with_checksum(size, H5Tget_size(stored), file);
    const Handle set =
        made(H5Dcreate2(group, column.name, stored, space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT), file);
    if (H5Dwrite(set.get(), native, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0) fail(file);
    describe(set.get(), column, file);
}

/// The descriptor of an open HDF5 file, −1 if it has none.
int descriptor_of(hid_t open_file) {
    void* descriptor = nullptr;
    return H5Fget_vfd_handle(open_file, H5P_DEFAULT, &descriptor) < 0 ? -1 : *static_cast<int*>(descriptor);
}

}  // namespace

void reserve(hid_t open_file, std::uint64_t bytes, const std::string& file) {
    const int descriptor = descriptor_of(open_file);
    hsize_t end = 0;
    if (descriptor < 0 || H5Fget_filesize(open_file, &end) < 0) fail(file);
    rlimit largest{};
    getrlimit(RLIMIT_FSIZE, &largest);
    int failure = largest.rlim_cur != RLIM_INFINITY && end + bytes > largest.rlim_cur ? EFBIG : 0;
    if (failure == 0 &&
        fallocate(descriptor, FALLOC_FL_KEEP_SIZE, static_cast<off_t>(end), static_cast<off_t>(bytes)) != 0)
        failure = errno;
    if (failure == 0 || failure == EOPNOTSUPP || failure == ENOSYS) return;  // not every file system can reserve
    throw InputError(fmt::format("{}: the trajectory cannot be written: {}", file, std::strerror(failure)));
}

void release_reserve(hid_t open_file) {
    const int descriptor = descriptor_of(open_file);
    struct stat status {};
    if (descriptor >= 0 && fstat(descriptor, &status) == 0 && ftruncate(descriptor, status.st_size) != 0) return;
}

Handle made(hid_t id, const std::string& file) {
    if (id < 0 && is_full(errno)) fail(file);
    if (id < 0) throw InputError(fmt::format("{}: HDF5 cannot write or continue the trajectory", file));
    return Handle(id);
}

Handle group_in(hid_t parent, const char* name, bool open, const std::string& file) {
    return made(
        open ? H5Gopen2(parent, name, H5P_DEFAULT) : H5Gcreate2(parent, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
        file);
}

void put_text(hid_t object, const char* name, const std::string& text, const std::string& file) {
    const Handle type = made(H5Tcopy(H5T_C_S1), file);
    H5Tset_size(type.get(), std::max<std::size_t>(1, text.size()));
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    const Handle space = made(H5Screate(H5S_SCALAR), file);
    const Handle attribute = made(H5Acreate2(object, name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT), file);
    if (H5Awrite(attribute.get(), type.get(), text.data()) < 0) fail(file);
}

void put_number(hid_t object, const char* name, double value, const std::string& file) {
    const Handle space = made(H5Screate(H5S_SCALAR), file);
    const Handle attribute =
        made(H5Acreate2(object, name, H5T_IEEE_F64LE, space.get(), H5P_DEFAULT, H5P_DEFAULT), file);
    if (H5Awrite(attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0) fail(file);
}

void put_texts(hid_t group, const char* name, const std::vector<std::string>& texts, const std::string& file) {
    if (texts.empty()) return;
    std::size_t length = 1;
    for (const auto& text : texts) length = std::max(length, text.size());
    std::string block;
    for (const auto& text : texts) {
        block += text;
        block.resize(block.size() + length - text.size(), '\0');
    }
    const Handle type = made(H5Tcopy(H5T_C_S1), file);
    H5Tset_size(type.get(), length);
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
    const hsize_t count = texts.size();
    const Handle space = made(H5Screate_simple(1, &count, nullptr), file);
    const Handle creation = with_checksum({count}, length, file);
    const Handle set =
        made(H5Dcreate2(group, name, type.get(), space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT), file);
    if (H5Dwrite(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, block.data()) < 0) fail(file);
}

void put_rows(hid_t group, const Column& column, const std::vector<double>& values, const std::vector<hsize_t>& shape,
              const std::string& file) {
    put(group, column, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, values.data(), values.size(), shape, file);
}

void put_rows(hid_t group, const Column& column, const std::vector<std::int32_t>& values,
              const std::vector<hsize_t>& shape, const std::string& file) {
    put(group, column, H5T_STD_I32LE, H5T_NATIVE_INT32, values.data(), values.size(), shape, file);
}

Series::Series(hid_t group, const Column& column, std::vector<hsize_t> shape, bool resume, std::int64_t rows,
               const std::string& file)
    : file_(file),
      name_(column.name),
      shape_(std::move(shape)),
      set_(resume ? open(group, column, rows) : create(group, column)) {
    rows_ = resume ? static_cast<hsize_t>(rows) : 0;
}

hsize_t Series::width() const {
    hsize_t width = 1;
    for (const auto extent : shape_) width *= extent;
    return width;
}

std::uint64_t Series::growth() const {
    /// A node of the tree that finds the chunks, with room to spare.
    constexpr std::uint64_t tree_node = 8192;
    if (waiting_.empty()) return 0;
    return waiting() + sizeof(double) * 2 * rows_of_chunk() * width() + tree_node;
}

hsize_t Series::rows_of_chunk() const {
    return std::max<hsize_t>(1, 4096 / width());
}

void Series::write() {
    if (waiting_.empty()) return;
    const hsize_t count = waiting_.size() / width();
    std::vector<hsize_t> size = {rows_ + count}, start = {rows_}, block = {count};
    for (const auto extent : shape_) {
        size.push_back(extent);
        start.push_back(0);
        block.push_back(extent);
    }
    bool written = H5Dset_extent(set_.get(), size.data()) >= 0;
    const Handle space = made(H5Dget_space(set_.get()), file_);
    const Handle memory = made(H5Screate_simple(static_cast<int>(block.size()), block.data(), nullptr), file_);
    written =
        written && H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr) >= 0;
    written = written &&
              H5Dwrite(set_.get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT, waiting_.data()) >= 0;
    if (!written) fail(file_);
    rows_ += count;
    waiting_.clear();
}

bool Series::read(hsize_t first, hsize_t last, bool checked, std::vector<double>& values) const {
    std::vector<hsize_t> start = {first}, block = {last - first};
    for (const auto extent : shape_) {
        start.push_back(0);
        block.push_back(extent);
    }
    values.resize(block[0] * width());
    if (values.empty()) return true;
    const Handle space = made(H5Dget_space(set_.get()), file_);
    const Handle memory = made(H5Screate_simple(static_cast<int>(block.size()), block.data(), nullptr), file_);
    const Handle transfer = made(H5Pcreate(H5P_DATASET_XFER), file_);
    H5Pset_edc_check(transfer.get(), checked ? H5Z_ENABLE_EDC : H5Z_DISABLE_EDC);
    return H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr) >= 0 &&
           H5Dread(set_.get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), transfer.get(), values.data()) >= 0;
}

double Series::last() const {
    std::vector<double> row;
    if (rows_ == 0) return 0.0;
    if (!read(rows_ - 1, rows_, false, row))
        throw InputError(fmt::format("{}: the trajectory cannot be continued", file_));
    return row.back();
}

void Series::require_kept(std::uint64_t expected) {
    std::vector<double> values;
    bool whole = true;
    for (hsize_t first = 0; whole && first < rows_; first += rows_of_chunk()) {
        whole = read(first, std::min(rows_, first + rows_of_chunk()), false, values);
        note(values.data(), values.size());
    }
    if (!whole || written_ != expected)
        throw InputError(fmt::format(
            "{}: the trajectory cannot be continued: \"{}\" is not what the run has written up to its checkpoint",
            file_, name_));
}

void Series::cut() {
    // A run that was killed while it wrote the last chunk can have left it with the checksum of another state of it.
    // HDF5 would not change such a chunk; what it holds of the rows to keep is written anew.
    const hsize_t before = rows_ - rows_ % rows_of_chunk();
    std::vector<double> tail;
    if (!read(before, rows_, true, tail)) {
        if (!read(before, rows_, false, tail)) fail(file_);
        waiting_.insert(waiting_.begin(), tail.begin(), tail.end());
        rows_ = before;
    }
    std::vector<hsize_t> size = {rows_};
    size.insert(size.end(), shape_.begin(), shape_.end());
    if (H5Dset_extent(set_.get(), size.data()) < 0) fail(file_);
}

Handle Series::create(hid_t group, const Column& column) const {
    std::vector<hsize_t> size = {0}, most = {H5S_UNLIMITED}, chunk = {rows_of_chunk()};
    for (const auto extent : shape_) {
        size.push_back(extent);
        most.push_back(extent);
        chunk.push_back(extent);
    }
    const Handle space = made(H5Screate_simple(static_cast<int>(size.size()), size.data(), most.data()), file_);
    const Handle creation = made(H5Pcreate(H5P_DATASET_CREATE), file_);
    H5Pset_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data());
    H5Pset_fletcher32(creation.get());
    Handle set = made(H5Dcreate2(group, column.name, column.integer ? H5T_STD_I64LE : H5T_IEEE_F64LE, space.get(),
                                 H5P_DEFAULT, creation.get(), H5P_DEFAULT),
                      file_);
    describe(set.get(), column, file_);
    return set;
}

Handle Series::open(hid_t group, const Column& column, std::int64_t rows) const {
    Handle set = made(H5Dopen2(group, column.name, H5P_DEFAULT), file_);
    const Handle space = made(H5Dget_space(set.get()), file_);
    std::vector<hsize_t> size(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space.get()))));
    H5Sget_simple_extent_dims(space.get(), size.data(), nullptr);
    if (size.size() != shape_.size() + 1 || !std::equal(shape_.begin(), shape_.end(), size.begin() + 1) ||
        size[0] < static_cast<hsize_t>(rows))
        throw InputError(
            fmt::format("{}: \"{}\" is shorter than the checkpoint says, or of another shape", file_, column.name));
    return set;
}

}  // namespace delassus::trajectory
