// SPDX-License-Identifier: BSD-3-Clause
#include "fclib/isolated.hpp"

#include <fmt/format.h>

#include <cstring>
#include <string>
#include <type_traits>

#include "delassus/error.hpp"
#include "fclib/fclib.hpp"
#include "support/call_in_child.hpp"

namespace delassus::fclib {
namespace {

/// Processor time for the smallest file, and bytes a second beyond that; some damaged files keep HDF5 busy for ever.
constexpr unsigned least_seconds = 20;
constexpr std::uintmax_t bytes_per_second = 5'000'000;

class Packer {
public:
    std::string bytes;

    void text(const std::string& value) { array(value.data(), value.size()); }
    template <class Number>
    void vector(const std::vector<Number>& values) {
        array(values.data(), values.size());
    }
    template <class Number>
    void number(Number value) {
        static_assert(std::is_trivially_copyable_v<Number>);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void matrix(const SparseMatrix& A) {
        number(A.rows);
        number(A.columns);
        vector(A.row_start);
        vector(A.column);
        vector(A.value);
    }
    /// Friction cones and free rows, which is all that FCLib has.
    void problem(const Problem& problem) {
        for (const SparseMatrix* A : {&problem.H, &problem.D, &problem.E}) matrix(*A);
        vector(problem.a);
        vector(problem.b);
        number(problem.cones.size());
        for (const Cone& cone : problem.cones) {
            number(cone.kind);
            number(cone.rows);
            number(cone.mu);
        }
        number(problem.law);
        for (const std::string* value : {&problem.name, &problem.source, &problem.notes}) text(*value);
    }

private:
    template <class Element>
    void array(const Element* data, std::size_t count) {
        number(count);
        if (count > 0) bytes.append(reinterpret_cast<const char*>(data), count * sizeof(Element));
    }
};

/// The child was led by a file that may be hostile, so nothing it says is believed without a look.
class Unpacker {
public:
    explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}

    [[nodiscard]] bool complete() const { return good_ && bytes_.empty(); }

    std::string text() { return array<std::string>(); }

    Problem problem() {
        Problem problem;
        for (SparseMatrix* A : {&problem.H, &problem.D, &problem.E}) *A = matrix();
        problem.a = array<std::vector<double>>();
        problem.b = array<std::vector<double>>();
        for (auto count = number<std::size_t>(); count > 0 && good_; --count) {
            Cone cone;
            cone.kind = number<ConeKind>();
            cone.rows = number<std::int32_t>();
            cone.mu = number<double>();
            problem.cones.push_back(std::move(cone));
        }
        problem.law = number<Law>();
        for (std::string* value : {&problem.name, &problem.source, &problem.notes}) *value = text();
        return problem;
    }

private:
    template <class Number>
    Number number() {
        Number value{};
        take(&value, sizeof value, 1);
        return value;
    }

    template <class Array>
    Array array() {
        Array values;
        const auto count = number<std::size_t>();
        constexpr std::size_t size = sizeof(typename Array::value_type);
        if (count > bytes_.size() / size) {
            good_ = false;
        } else {
            values.resize(count);
            take(values.data(), size, count);
        }
        return values;
    }

    SparseMatrix matrix() {
        SparseMatrix A;
        A.rows = number<std::int32_t>();
        A.columns = number<std::int32_t>();
        A.row_start = array<std::vector<std::int32_t>>();
        A.column = array<std::vector<std::int32_t>>();
        A.value = array<std::vector<double>>();
        return A;
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

}  // namespace

Problem read_isolated(const std::filesystem::path& file) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    const auto seconds = least_seconds + (error ? 0 : static_cast<unsigned>(bytes / bytes_per_second));
    const std::string message = call_in_child(file, "HDF5", seconds, [&] {
        Packer packer;
        packer.problem(read_file(file));
        return packer.bytes;
    });
    Unpacker content(message);
    Problem problem = content.problem();
    if (!content.complete()) throw InputError(fmt::format("{} is damaged: HDF5 fails on it.", file.string()));
    validate(problem);
    return problem;
}

}  // namespace delassus::fclib
