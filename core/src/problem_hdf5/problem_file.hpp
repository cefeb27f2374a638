// SPDX-License-Identifier: BSD-3-Clause
// A problem's file, open for reading (docs/files.md, "Problems in one file").
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "delassus/partitioned_files.hpp"
#include "hdf5/hdf5.hpp"

namespace delassus::problem_hdf5 {

inline constexpr const char* problem_format = "delassus-problem";
inline constexpr const char* solution_format = "delassus-solution";
inline constexpr std::int64_t format_version = 1;

/// A file whose format and version have been checked. Throws InputError.
class OpenFile {
public:
    OpenFile(const std::filesystem::path& path, const char* format);

    [[nodiscard]] const hdf5::Group& root() const { return *root_; }
    [[nodiscard]] std::int64_t bytes() const { return bytes_; }

private:
    hdf5::Handle file_;
    std::optional<hdf5::Group> root_;
    std::int64_t bytes_ = 0;
};

/// Opens the file in a child process and touches every dataset at both ends: HDF5 crashes on some damaged files.
void check_in_child(const std::filesystem::path& path, const char* format);

/// A matrix by compressed rows.
struct MatrixArrays {
    hdf5::Array row_start, column, value;
};

class ProblemFile {
public:
    /// Opens the datasets and checks that their sizes fit together.
    explicit ProblemFile(const std::filesystem::path& path);

    /// A place where a process may begin.
    struct Cut {
        std::int64_t column = 0, cone = 0;
        std::int64_t row = 0;   ///< of that cone
        std::int64_t body = 0;  ///< with body_start: that of the column
    };
    [[nodiscard]] Cut end() const;
    /// Where process p of so many begins so that columns and rows together are even shares; a cone belongs to the body
    /// of its smallest column, which must not fall from one cone to the next.
    [[nodiscard]] Cut cut_by_bodies(int process, int processes) const;
    /// Where columns are even shares, and rows.
    [[nodiscard]] Cut cut_evenly(int process, int processes) const;
    /// Whether cones can go with their bodies.
    [[nodiscard]] bool has_bodies_and_cones() const { return n_ > 0 && D_ && D_->column.count() > 0; }

    /// Fills what the process owns; `part` has its starts.
    void read_slice(const Cut& first, const Cut& last, PartitionedProblem& part) const;

    [[nodiscard]] LocalMatrix rows_of(const char* name, std::int64_t first, std::int64_t last) const;
    struct ConeShapes {
        std::vector<std::int64_t> row_start, kind;
    };
    /// Of the cones first … last − 1; row_start has one more. Kinds are known and sizes positive.
    [[nodiscard]] ConeShapes cone_shapes(std::int64_t first, std::int64_t last) const;
    /// The first place from `column` on that does not lie within a small block of H.
    [[nodiscard]] std::int64_t after_block(std::int64_t column) const;

    [[nodiscard]] std::int64_t n() const { return n_; }
    [[nodiscard]] std::int64_t m() const { return m_; }
    [[nodiscard]] std::int64_t cone_count() const { return cone_row_.count() - 1; }
    [[nodiscard]] std::int64_t body_count() const { return body_start_ ? body_start_->count() - 1 : 0; }
    [[nodiscard]] std::int64_t entries(const char* name) const;
    [[nodiscard]] const OpenFile& file() const { return file_; }
    [[nodiscard]] std::string text(const char* name) const { return file_.root().attribute_text(name); }
    [[nodiscard]] Law law() const;
    /// Bytes of datasets read so far.
    [[nodiscard]] std::int64_t bytes_read() const { return bytes_read_; }

    /// Reads the first and the last element of every dataset.
    void touch() const;

private:
    [[nodiscard]] const std::optional<MatrixArrays>& matrix(const char* name) const;
    [[nodiscard]] std::optional<MatrixArrays> open_matrix(const char* name, std::int64_t rows) const;
    [[nodiscard]] std::vector<std::int64_t> integers(const hdf5::Array&, std::int64_t first, std::int64_t last) const;
    [[nodiscard]] std::vector<double> numbers(const hdf5::Array&, std::int64_t first, std::int64_t last) const;
    [[nodiscard]] std::int64_t at(const hdf5::Array& array, std::int64_t index) const {
        return integers(array, index, index + 1)[0];
    }
    [[nodiscard]] std::int64_t smallest_column(std::int64_t cone) const;
    [[nodiscard]] std::int64_t first_cone_from(std::int64_t column) const;
    /// The first column of body k, or k where bodies are unknown.
    [[nodiscard]] std::int64_t column_of(std::int64_t body) const {
        return body_start_ ? at(*body_start_, body) : body;
    }
    [[nodiscard]] std::int64_t places() const { return body_start_ ? body_start_->count() - 1 : n_; }
    [[noreturn]] void refuse(const std::string& what) const { file_.root().refuse(what); }

    OpenFile file_;
    std::int64_t n_ = 0, m_ = 0;
    hdf5::Array a_, b_, cone_row_, cone_kind_;
    std::optional<MatrixArrays> H_, D_, E_;
    std::optional<hdf5::Array> body_start_, lo_, hi_;
    std::vector<std::pair<std::string, hdf5::Array>> parameters_;  ///< by name
    mutable std::int64_t bytes_read_ = 0;
};

}  // namespace delassus::problem_hdf5
