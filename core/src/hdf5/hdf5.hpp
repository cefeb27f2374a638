// SPDX-License-Identifier: BSD-3-Clause
// HDF5: handles that close themselves, and datasets that are checked before anything of their announced size is
// allocated. Whatever HDF5 has to say becomes one InputError.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace delassus::hdf5 {

/// Keeps HDF5 from printing its errors while it lives.
class Silence {
public:
    Silence();
    Silence(const Silence&) = delete;
    Silence& operator=(const Silence&) = delete;
    ~Silence();

private:
    H5E_auto2_t function_ = nullptr;
    void* data_ = nullptr;
};

/// An HDF5 identifier of any kind; closed with its last owner.
class Handle {
public:
    Handle() = default;
    explicit Handle(hid_t id) : id_(id) {}
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(id_, other.id_);
        return *this;
    }
    ~Handle();
    [[nodiscard]] hid_t get() const { return id_; }
    [[nodiscard]] bool valid() const { return id_ >= 0; }

private:
    hid_t id_ = H5I_INVALID_HID;
};

/// Throws std::bad_alloc unless there is the memory that HDF5 needs for small files, and so many bytes more. HDF5
/// crashes if an allocation of its own fails.
void require_memory(std::uint64_t bytes = 0);

/// What HDF5 last complained about, in its words; empty if nothing.
std::string last_complaint();

/// An open dataset of numbers of one dimension, of which ranges are read.
class Array {
public:
    [[nodiscard]] std::int64_t count() const { return count_; }
    /// Bytes that one element takes in the file.
    [[nodiscard]] std::int64_t element_bytes() const { return element_bytes_; }
    /// Elements first … first + values.size() − 1, which must exist. Integers of any width are read as 64-bit ones.
    void read(std::int64_t first, std::span<std::int64_t> values) const;
    void read(std::int64_t first, std::span<double> values) const;

private:
    friend class Group;
    void read(std::int64_t first, std::size_t count, hid_t type, void* values) const;

    Handle id_;
    std::string place_;  ///< file and dataset, for messages
    std::int64_t count_ = 0, element_bytes_ = 0;
};

/// A group of an open file that knows its place for messages.
class Group {
public:
    Group(Handle id, std::string file, std::string place, std::uint64_t file_bytes)
        : id_(std::move(id)), file_(std::move(file)), place_(std::move(place)), file_bytes_(file_bytes) {}

    [[noreturn]] void refuse(const std::string& sentence_end) const;

    [[nodiscard]] bool has(const char* name) const;
    [[nodiscard]] Group group(const char* name) const;

    /// Number of elements of the dataset.
    [[nodiscard]] std::int64_t count(const char* name) const;
    /// The one integer of a dataset, within least … most.
    [[nodiscard]] std::int32_t integer(const char* name, std::int32_t least, std::int32_t most) const;
    /// The first `count` elements of a dataset that has at least as many.
    [[nodiscard]] std::vector<std::int64_t> integers(const char* name, std::int64_t count) const;
    /// All elements of a dataset that has exactly `count`.
    [[nodiscard]] std::vector<double> numbers(const char* name, std::int64_t count) const;
    /// The first `count` elements of a dataset that has at least as many.
    [[nodiscard]] std::vector<double> first_numbers(const char* name, std::int64_t count) const;
    /// A short text of fixed length, empty if there is none.
    [[nodiscard]] std::string text(const char* name) const;
    /// Texts of one fixed length, padded with zeros: a row each.
    [[nodiscard]] std::vector<std::string> texts(const char* name) const;

    /// Datasets of one dimension, open for reading ranges.
    [[nodiscard]] Array integer_array(const char* name) const { return array(name, false); }
    [[nodiscard]] Array number_array(const char* name) const { return array(name, true); }

    /// The extents of the dataset.
    [[nodiscard]] std::vector<std::int64_t> shape(const char* name) const;
    /// The chosen rows, ascending, of a dataset whose rows have `width` numbers.
    [[nodiscard]] std::vector<double> rows(const char* name, const std::vector<std::int64_t>& chosen,
                                           std::int64_t width) const;

    /// The names of the groups and datasets in it, by name.
    [[nodiscard]] std::vector<std::string> members() const;
    /// Refuses a group or dataset in it that is none of these.
    void require_only(const std::vector<std::string_view>& known) const;
    /// A short text of fixed or of variable length that hangs on the group; empty if there is none.
    [[nodiscard]] std::string attribute_text(const char* name) const;
    /// An integer that hangs on the group; `missing` if there is none.
    [[nodiscard]] std::int64_t attribute_integer(const char* name, std::int64_t missing) const;
    /// A number that hangs on the group; not a number if there is none.
    [[nodiscard]] double attribute_number(const char* name) const;

private:
    struct Dataset {
        Handle id;
        Handle type;
        std::int64_t count = 0;
    };
    [[nodiscard]] Dataset open(const char* name) const;
    [[nodiscard]] Array array(const char* name, bool real) const;
    template <class Number>
    [[nodiscard]] std::vector<Number> read(const char* name, std::int64_t count, bool exactly) const;

    Handle id_;
    std::string file_;
    std::string place_;
    std::uint64_t file_bytes_;
};

}  // namespace delassus::hdf5
