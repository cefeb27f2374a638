// SPDX-License-Identifier: BSD-3-Clause
// How a child process tells its parent what it has read: numbers, arrays and texts one after the other, as bytes.
// Packer and Unpacker are called alike, so that one function, a template of the message, lists the parts of a struct
// for both:
//
//     template <class Message> void transfer(Message& message, Thing& thing) { message(thing.name); message(thing.x); }
#pragma once

#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "delassus/array.hpp"

namespace delassus::hdf5 {

class Packer {
public:
    std::string bytes;

    template <class Number>
    void operator()(const Number& value) {
        static_assert(std::is_trivially_copyable_v<Number>);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void operator()(const std::string& value) { array(value.data(), value.size()); }
    template <class Element>
    void operator()(const std::vector<Element>& values) {
        if constexpr (std::is_trivially_copyable_v<Element>) {
            array(values.data(), values.size());
        } else {
            each(values, [this](const Element& element) { (*this)(element); });
        }
    }
    template <class Number>
    void operator()(const delassus::Array<Number>& values) {
        array(values.data(), values.size());
    }
    /// part(element) packs one.
    template <class Vector, class Part>
    void each(Vector& values, Part&& part) {
        (*this)(values.size());
        for (auto& value : values) part(value);
    }

private:
    template <class Element>
    void array(const Element* data, std::size_t count) {
        (*this)(count);
        if (count > 0) bytes.append(reinterpret_cast<const char*>(data), count * sizeof(Element));
    }
};

/// Reads what a Packer made. The child read a file that may be hostile, so its message is checked: missing parts are
/// read as zero or empty, and complete() is false then.
class Unpacker {
public:
    explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}

    /// Nothing was missing, and nothing is left.
    [[nodiscard]] bool complete() const { return good_ && bytes_.empty(); }

    template <class Number>
    void operator()(Number& value) {
        static_assert(std::is_trivially_copyable_v<Number>);
        value = Number{};
        take(&value, sizeof value, 1);
    }
    void operator()(std::string& value) { array(value); }
    template <class Element>
    void operator()(std::vector<Element>& values) {
        if constexpr (std::is_trivially_copyable_v<Element>) {
            array(values);
        } else {
            each(values, [this](Element& element) { (*this)(element); });
        }
    }
    template <class Number>
    void operator()(delassus::Array<Number>& values) {
        array(values);
    }
    /// part(element) unpacks one.
    template <class Vector, class Part>
    void each(Vector& values, Part&& part) {
        std::size_t count = 0;
        (*this)(count);
        for (values.clear(); count > 0 && good_; --count) part(values.emplace_back());
    }

private:
    template <class Values>
    void array(Values& values) {
        std::size_t count = 0;
        (*this)(count);
        constexpr std::size_t size = sizeof(typename Values::value_type);
        values.clear();
        if (count > bytes_.size() / size) {
            good_ = false;
        } else {
            values.resize(count);
            take(values.data(), size, count);
        }
    }

    void take(void* target, std::size_t size, std::size_t count) {
        if (!good_ || count > bytes_.size() / size) {
            good_ = false;
            return;
        }
        if (count > 0) std::memcpy(target, bytes_.data(), size * count);
        bytes_.remove_prefix(size * count);
    }

    std::string_view bytes_;
    bool good_ = true;
};

}  // namespace delassus::hdf5
