// SPDX-License-Identifier: BSD-3-Clause
// Writing HDF5 objects of a trajectory. Each function throws InputError if HDF5 fails; file: its name for the message.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "hdf5/hdf5.hpp"

namespace delassus::trajectory {

/// Reserves disk space for so many bytes at the end of the file before HDF5 begins to change it. HDF5 changes a file in
/// place, and the file is lost if the disk is full before the change is complete.
void reserve(hid_t open_file, std::uint64_t bytes, const std::string& file);

/// Releases reserved space that has not become part of the file.
void release_reserve(hid_t open_file);

/// A handle of what HDF5 has just made or opened.
hdf5::Handle made(hid_t id, const std::string& file);

/// Makes the group in parent, or opens it.
hdf5::Handle group_in(hid_t parent, const char* name, bool open, const std::string& file);

void put_text(hid_t object, const char* name, const std::string& text, const std::string& file);
void put_number(hid_t object, const char* name, double value, const std::string& file);

/// A dataset's name, with what its attributes say of it.
struct Column {
    const char* name;
    const char* unit;
    const char* description;
    bool integer = false;
};

/// A dataset of texts of one length, padded with zeros. Nothing is written if there are none; the next ones likewise.
void put_texts(hid_t group, const char* name, const std::vector<std::string>& texts, const std::string& file);
/// A dataset of rows of the given shape.
void put_rows(hid_t group, const Column& column, const std::vector<double>& values, const std::vector<hsize_t>& shape,
              const std::string& file);
void put_rows(hid_t group, const Column& column, const std::vector<std::int32_t>& values,
              const std::vector<hsize_t>& shape, const std::string& file);

/// A dataset of numbers that grows by rows. Rows wait in memory until write().
class Series {
public:
    /// shape: of one row. rows: to keep of a dataset that is there; a new one otherwise.
    Series(hid_t group, const Column& column, std::vector<hsize_t> shape, bool resume, std::int64_t rows,
           const std::string& file);

    void add(double value) { add(&value, 1); }
    void add(const double* values, std::size_t count) {
        note(values, count);
        waiting_.insert(waiting_.end(), values, values + count);
    }
    void write();

    /// Takes the rows to keep into the checksum; throws InputError if it is not this one then.
    void require_kept(std::uint64_t expected);
    /// Goes on from rows whose checksum this is.
    void begin_from(std::uint64_t kept) { written_ = kept; }
    /// Cuts off what is beyond the rows to keep.
    void cut();
    /// The checksum of all numbers on disk and waiting, in their order. One number that differs changes it for certain.
    [[nodiscard]] std::uint64_t written() const { return written_; }

    /// How many bytes write() makes the file longer, at most.
    [[nodiscard]] std::uint64_t growth() const;
    /// Bytes that wait.
    [[nodiscard]] std::uint64_t waiting() const { return sizeof(double) * waiting_.size(); }

    /// The last number on disk, 0 if there is none.
    [[nodiscard]] double last() const;

private:
    [[nodiscard]] hdf5::Handle create(hid_t group, const Column& column) const;
    [[nodiscard]] hdf5::Handle open(hid_t group, const Column& column, std::int64_t rows) const;
    /// Rows first … last − 1 on disk; checked: by the checksums of HDF5. False if HDF5 fails.
    [[nodiscard]] bool read(hsize_t first, hsize_t last, bool checked, std::vector<double>& values) const;
    /// FNV-1a by words.
    void note(const double* values, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i)
            written_ = (written_ ^ std::bit_cast<std::uint64_t>(values[i])) * 0x100000001b3ULL;
    }
    [[nodiscard]] hsize_t width() const;
    [[nodiscard]] hsize_t rows_of_chunk() const;

    const std::string& file_;
    std::string name_;
    std::vector<hsize_t> shape_;
    std::uint64_t written_ = 0xcbf29ce484222325ULL;
    hdf5::Handle set_;
    hsize_t rows_ = 0;
    std::vector<double> waiting_;
};

}  // namespace delassus::trajectory
