// SPDX-License-Identifier: BSD-3-Clause
#include "hdf5/hdf5.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

#include "delassus/error.hpp"
#include "support/nearest_name.hpp"

namespace delassus::hdf5 {
namespace {

/// A dataset may announce more than it stores where chunks are compressed or were never written. Announcements up to
/// this size are believed.
constexpr std::uint64_t most_compression = 100;
constexpr std::uint64_t small_bytes = 1 << 20;
constexpr std::size_t longest_text = 1 << 16;

bool one_of(hid_t type, std::initializer_list<hid_t> known) {
    return std::any_of(known.begin(), known.end(), [&](hid_t other) { return H5Tequal(type, other) > 0; });
}

bool is_plain_integer(hid_t type) {
    return one_of(type, {H5T_STD_I8LE, H5T_STD_I8BE, H5T_STD_I16LE, H5T_STD_I16BE, H5T_STD_I32LE, H5T_STD_I32BE,
                         H5T_STD_I64LE, H5T_STD_I64BE, H5T_STD_U8LE, H5T_STD_U8BE, H5T_STD_U16LE, H5T_STD_U16BE,
                         H5T_STD_U32LE, H5T_STD_U32BE, H5T_STD_U64LE, H5T_STD_U64BE});
}

bool is_plain_number(hid_t type) {
    return one_of(type, {H5T_IEEE_F32LE, H5T_IEEE_F32BE, H5T_IEEE_F64LE, H5T_IEEE_F64BE});
}

}  // namespace

Silence::Silence() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Silence::~Silence() {
    H5Eset_auto2(H5E_DEFAULT, function_, data_);
}

Handle::~Handle() {
    if (id_ >= 0) H5Idec_ref(id_);
}

void require_memory(std::uint64_t bytes) {
    constexpr std::uint64_t of_hdf5 = 8 << 20;  // caches of metadata and chunks, buffers to convert in
    void* volatile block = ::operator new(of_hdf5 + bytes);
    ::operator delete(block);
}

std::string last_complaint() {
    std::string text;
    // From the innermost failure outwards: the first one says most.
    const auto keep_first = [](unsigned, const H5E_error2_t* error, void* data) -> herr_t {
        auto& kept = *static_cast<std::string*>(data);
        if (kept.empty() && error->desc != nullptr) kept = error->desc;
        return 0;
    };
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first, &text);
    // A failed system call is told by time, file and addresses, with the system's own words among them.
    const std::string opening = "error message = '";
    if (const auto at = text.find(opening); at != std::string::npos) {
        text.erase(0, at + opening.size());
        text.resize(std::min(text.find('\''), text.size()));
    }
    return text.substr(0, 200);
}

void Group::refuse(const std::string& sentence_end) const {
    throw InputError(fmt::format("{}: {}{}.", file_, place_, sentence_end));
}

bool Group::has(const char* name) const {
    return H5Lexists(id_.get(), name, H5P_DEFAULT) > 0;
}

Group Group::group(const char* name) const {
    if (!has(name)) refuse(fmt::format("/{} is missing", name));
    // A soft or external link could lead anywhere, even into another file.
    H5L_info_t link{};
    if (H5Lget_info(id_.get(), name, &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) {
        refuse(fmt::format("/{} is a link; it must stand in the file itself", name));
    }
    Handle id(H5Gopen2(id_.get(), name, H5P_DEFAULT));
    if (!id.valid()) refuse(fmt::format("/{} must be a group, but cannot be opened ({})", name, last_complaint()));
    return {std::move(id), file_, place_ + "/" + name, file_bytes_};
}

Group::Dataset Group::open(const char* name) const {
    if (!has(name)) refuse(fmt::format("/{} is missing", name));
    H5L_info_t link{};
    if (H5Lget_info(id_.get(), name, &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) {
        refuse(fmt::format("/{} is a link; it must stand in the file itself", name));
    }
    Dataset dataset;
    dataset.id = Handle(H5Dopen2(id_.get(), name, H5P_DEFAULT));
    if (!dataset.id.valid()) {
        refuse(fmt::format("/{} must be a dataset, but cannot be opened ({})", name, last_complaint()));
    }
    dataset.type = Handle(H5Dget_type(dataset.id.get()));
    const Handle space(H5Dget_space(dataset.id.get()));
    const Handle creation(H5Dget_create_plist(dataset.id.get()));
    const hssize_t count = space.valid() ? H5Sget_simple_extent_npoints(space.get()) : -1;
    if (!dataset.type.valid() || !creation.valid() || count < 0) {
        refuse(fmt::format("/{} has no readable type or size ({})", name, last_complaint()));
    }
    const H5D_layout_t layout = H5Pget_layout(creation.get());
    if (layout == H5D_VIRTUAL || layout == H5D_LAYOUT_ERROR || H5Pget_external_count(creation.get()) != 0) {
        refuse(fmt::format("/{} is stored outside the file", name));
    }
    dataset.count = count;
    const std::uint64_t element = std::max<std::uint64_t>(1, H5Tget_size(dataset.type.get()));
    const auto elements = static_cast<std::uint64_t>(count);
    const std::uint64_t stored = std::min<std::uint64_t>(H5Dget_storage_size(dataset.id.get()), file_bytes_);
    const std::uint64_t believed = std::max(small_bytes, layout == H5D_CHUNKED ? most_compression * stored : stored);
    if (elements > believed / element) {
        refuse(fmt::format("/{} announces {} elements, but stores only {} bytes", name, elements, stored));
    }
    return dataset;
}

template <class Number>
std::vector<Number> Group::read(const char* name, std::int64_t count, bool exactly) const {
    constexpr bool real = std::is_floating_point_v<Number>;
    const Dataset dataset = open(name);
    if (real ? !is_plain_number(dataset.type.get()) : !is_plain_integer(dataset.type.get())) {
        refuse(fmt::format("/{} must hold {}", name, real ? "floating-point numbers" : "integers"));
    }
    if (exactly ? dataset.count != count : dataset.count < count) {
        refuse(fmt::format("/{} has {} elements, but must have {}{}", name, dataset.count, exactly ? "" : "at least ",
                           count));
    }
    std::vector<Number> values(static_cast<std::size_t>(dataset.count));
    const hid_t type = real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT64;
    if (!values.empty() && H5Dread(dataset.id.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
        refuse(fmt::format("/{} cannot be read ({})", name, last_complaint()));
    }
    values.resize(static_cast<std::size_t>(count));
    return values;
}

std::int64_t Group::count(const char* name) const {
    return open(name).count;
}

std::int32_t Group::integer(const char* name, std::int32_t least, std::int32_t most) const {
    const std::int64_t value = read<std::int64_t>(name, 1, true)[0];
    if (value < least || value > most) {
        refuse(fmt::format("/{} is {}, but must be from {} to {}", name, value, least, most));
    }
    return static_cast<std::int32_t>(value);
}

std::vector<std::int64_t> Group::integers(const char* name, std::int64_t count) const {
    return read<std::int64_t>(name, count, false);
}

std::vector<double> Group::numbers(const char* name, std::int64_t count) const {
    return read<double>(name, count, true);
}

std::vector<double> Group::first_numbers(const char* name, std::int64_t count) const {
    return read<double>(name, count, false);
}

std::string Group::text(const char* name) const {
    if (!has(name)) return {};
    const Dataset dataset = open(name);
    const hid_t type = dataset.type.get();
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || dataset.count != 1) return {};
    const std::size_t size = H5Tget_size(type);
    if (size == 0 || size > longest_text) return {};
    std::string value(size, '\0');
    if (H5Dread(dataset.id.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value.data()) < 0) return {};
    value.resize(std::min(value.find('\0'), value.size()));
    return value;
}

std::vector<std::string> Group::texts(const char* name) const {
    const Dataset dataset = open(name);
    const hid_t type = dataset.type.get();
    const std::size_t length = H5Tget_size(type);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || length == 0 || length > longest_text)
        refuse(fmt::format("/{} must hold texts of fixed length", name));
    std::string block(static_cast<std::size_t>(dataset.count) * length, '\0');
    if (!block.empty() && H5Dread(dataset.id.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, block.data()) < 0)
        refuse(fmt::format("/{} cannot be read ({})", name, last_complaint()));
    std::vector<std::string> texts;
    for (std::size_t at = 0; at < block.size(); at += length) {
        const std::string text = block.substr(at, length);
        texts.push_back(text.substr(0, text.find('\0')));
    }
    return texts;
}

Array Group::array(const char* name, bool real) const {
    Dataset dataset = open(name);
    if (real ? !is_plain_number(dataset.type.get()) : !is_plain_integer(dataset.type.get()))
        refuse(fmt::format("/{} must hold {}", name, real ? "floating-point numbers" : "integers"));
    if (shape(name).size() != 1) refuse(fmt::format("/{} must have one dimension", name));
    Array array;
    array.element_bytes_ = static_cast<std::int64_t>(H5Tget_size(dataset.type.get()));
    array.count_ = dataset.count;
    array.place_ = fmt::format("{}: {}/{}", file_, place_, name);
    array.id_ = std::move(dataset.id);
    return array;
}

void Array::read(std::int64_t first, std::span<std::int64_t> values) const {
    read(first, values.size(), H5T_NATIVE_INT64, values.data());
}

void Array::read(std::int64_t first, std::span<double> values) const {
    read(first, values.size(), H5T_NATIVE_DOUBLE, values.data());
}

void Array::read(std::int64_t first, std::size_t count, hid_t type, void* values) const {
    if (count == 0) return;
    const hsize_t start = static_cast<hsize_t>(first), block = count;
    const Handle space(H5Dget_space(id_.get())), memory(H5Screate_simple(1, &block, nullptr));
    if (first < 0 || static_cast<std::uint64_t>(first) + count > static_cast<std::uint64_t>(count_) ||
        H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, &start, nullptr, &block, nullptr) < 0 ||
        H5Dread(id_.get(), type, memory.get(), space.get(), H5P_DEFAULT, values) < 0)
        throw InputError(fmt::format("{} cannot be read from {} to {} ({}).", place_, first,
                                     first + static_cast<std::int64_t>(count) - 1, last_complaint()));
}

std::vector<std::int64_t> Group::shape(const char* name) const {
    const Dataset dataset = open(name);
    const Handle space(H5Dget_space(dataset.id.get()));
    const int rank = H5Sget_simple_extent_ndims(space.get());
    if (rank < 0) refuse(fmt::format("/{} has no readable size ({})", name, last_complaint()));
    std::vector<hsize_t> extents(static_cast<std::size_t>(rank));
    H5Sget_simple_extent_dims(space.get(), extents.data(), nullptr);
    return {extents.begin(), extents.end()};
}

std::vector<double> Group::rows(const char* name, const std::vector<std::int64_t>& chosen, std::int64_t width) const {
    const Dataset dataset = open(name);
    if (!is_plain_number(dataset.type.get())) refuse(fmt::format("/{} must hold floating-point numbers", name));
    const auto extents = shape(name);
    std::int64_t found = 1;
    for (std::size_t i = 1; i < extents.size(); ++i) found *= extents[i];
    if (extents.empty() || found != width)
        refuse(fmt::format("/{} has rows of {} numbers, but must have {} in a row", name, found, width));
    if (!chosen.empty() && (chosen.front() < 0 || chosen.back() >= extents[0]))
        refuse(fmt::format("/{} has {} rows, but must have {}", name, extents[0], chosen.back() + 1));
    std::vector<double> values(chosen.size() * static_cast<std::size_t>(width));
    const Handle space(H5Dget_space(dataset.id.get()));
    std::vector<hsize_t> start(extents.size(), 0), block(extents.begin(), extents.end());
    // Neighbours are read at once.
    for (std::size_t i = 0; i < chosen.size() && width > 0; i += block[0]) {
        std::size_t end = i + 1;
        while (end < chosen.size() && chosen[end] == chosen[end - 1] + 1) ++end;
        start[0] = static_cast<hsize_t>(chosen[i]);
        block[0] = end - i;
        const Handle memory(H5Screate_simple(static_cast<int>(block.size()), block.data(), nullptr));
        double* to = values.data() + i * static_cast<std::size_t>(width);
        if (H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr) < 0 ||
            H5Dread(dataset.id.get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT, to) < 0)
            refuse(fmt::format("/{} cannot be read ({})", name, last_complaint()));
    }
    return values;
}

std::vector<std::string> Group::members() const {
    std::vector<std::string> names;
    const auto add = [](hid_t, const char* name, const H5L_info_t*, void* data) -> herr_t {
        static_cast<std::vector<std::string>*>(data)->emplace_back(name);
        return 0;
    };
    if (H5Literate(id_.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &names) < 0)
        refuse(fmt::format(" cannot be listed ({})", last_complaint()));
    return names;
}

void Group::require_only(const std::vector<std::string_view>& known) const {
    for (const auto& name : members())
        if (std::find(known.begin(), known.end(), name) == known.end())
            refuse(fmt::format("/{} has no meaning here{}", name, nearest_name_hint(name, known)));
}

std::string Group::attribute_text(const char* name) const {
    const Handle attribute(H5Aopen(id_.get(), name, H5P_DEFAULT));
    if (!attribute.valid()) return {};
    const Handle type(H5Aget_type(attribute.get())), space(H5Aget_space(attribute.get()));
    const std::size_t size = H5Tget_size(type.get());
    if (H5Tget_class(type.get()) != H5T_STRING || size > longest_text || H5Sget_simple_extent_npoints(space.get()) != 1)
        return {};
    if (H5Tis_variable_str(type.get()) != 0) {
        char* text = nullptr;
        if (H5Aread(attribute.get(), type.get(), &text) < 0 || text == nullptr) return {};
        std::string value(text, strnlen(text, longest_text));
        H5free_memory(text);
        return value;
    }
    std::string value(size, '\0');
    if (H5Aread(attribute.get(), type.get(), value.data()) < 0) return {};
    value.resize(std::min(value.find('\0'), value.size()));
    return value;
}

std::int64_t Group::attribute_integer(const char* name, std::int64_t missing) const {
    const Handle attribute(H5Aopen(id_.get(), name, H5P_DEFAULT));
    if (!attribute.valid()) return missing;
    const Handle type(H5Aget_type(attribute.get())), space(H5Aget_space(attribute.get()));
    std::int64_t value = missing;
    if (!is_plain_integer(type.get()) || H5Sget_simple_extent_npoints(space.get()) != 1) return missing;
    return H5Aread(attribute.get(), H5T_NATIVE_INT64, &value) < 0 ? missing : value;
}

double Group::attribute_number(const char* name) const {
    const Handle attribute(H5Aopen(id_.get(), name, H5P_DEFAULT));
    double value = std::numeric_limits<double>::quiet_NaN();
    if (!attribute.valid()) return value;
    const Handle type(H5Aget_type(attribute.get())), space(H5Aget_space(attribute.get()));
    if (!is_plain_number(type.get()) || H5Sget_simple_extent_npoints(space.get()) != 1) return value;
    H5Aread(attribute.get(), H5T_NATIVE_DOUBLE, &value);
    return value;
}

}  // namespace delassus::hdf5
