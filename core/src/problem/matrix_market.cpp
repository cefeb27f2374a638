// SPDX-License-Identifier: BSD-3-Clause
#include "problem/matrix_market.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>

#include "delassus/error.hpp"

namespace delassus {
namespace {

constexpr std::int64_t most_entries = std::numeric_limits<std::int32_t>::max();

/// Goes through the lines that count, field by field.
class Scanner {
public:
    Scanner(std::string_view text, const std::string& file)
        : next_line_(text.data()), end_(text.data() + text.size()), file_(file) {}

    /// To the next line that is neither blank nor a comment; false at the end of the text.
    bool next_line() {
        while (next_line_ != end_) {
            at_ = next_line_;
            line_end_ = std::find(at_, end_, '\n');
            next_line_ = line_end_ == end_ ? end_ : line_end_ + 1;
            ++line_;
            if (line_end_ != at_ && line_end_[-1] == '\r') --line_end_;
            skip_blanks();
            if (at_ != line_end_ && *at_ != '%') return true;
        }
        ++line_;
        return false;
    }

    /// The first line as it stands, comment or not.
    std::string_view banner() {
        at_ = next_line_;
        line_end_ = std::find(at_, end_, '\n');
        next_line_ = line_end_ == end_ ? end_ : line_end_ + 1;
        ++line_;
        if (line_end_ != at_ && line_end_[-1] == '\r') --line_end_;
        return {at_, static_cast<std::size_t>(line_end_ - at_)};
    }

    std::int64_t integer(const char* what) {
        skip_blanks();
        std::int64_t value = 0;
        const auto [stop, error] = std::from_chars(at_, line_end_, value);
        if (error == std::errc::result_out_of_range) refuse("{} is too large: \"{}\"", what, field());
        if (error != std::errc() || !ends_field(stop)) {
            refuse("{} must be an integer, but the line has {}", what, field_or_end());
        }
        at_ = stop;
        return value;
    }

    double number(bool integer_only) {
        skip_blanks();
        const char* begin = at_;
        if (line_end_ - begin > 1 && *begin == '+' && begin[1] != '-') ++begin;
        double value = 0.0;
        const auto [stop, error] = std::from_chars(begin, line_end_, value);
        if (error == std::errc::result_out_of_range) {
            refuse("the value \"{}\" is outside the range of double precision", field());
        }
        if (error != std::errc() || !ends_field(stop)) {
            refuse("a number must stand here, but the line has {}", field_or_end());
        }
        if (!std::isfinite(value)) refuse("the value is {}; every value must be finite", field());
        if (integer_only && value != std::trunc(value)) {
            refuse("the value \"{}\" is not an integer, but the first line says integer", field());
        }
        at_ = stop;
        return value;
    }

    void end_of_line(const char* wanted) {
        skip_blanks();
        if (at_ != line_end_) refuse("\"{}\" is too much; the line must be {}", field(), wanted);
    }

    template <class... Arguments>
    [[noreturn]] void refuse(fmt::format_string<Arguments...> text, Arguments&&... arguments) const {
        throw InputError(
            fmt::format("{}, line {}: {}.", file_, line_, fmt::format(text, std::forward<Arguments>(arguments)...)));
    }

    [[nodiscard]] std::int64_t line() const { return line_; }
    [[nodiscard]] std::int64_t bytes_left() const { return end_ - next_line_; }

private:
    void skip_blanks() {
        while (at_ != line_end_ && (*at_ == ' ' || *at_ == '\t')) ++at_;
    }

    [[nodiscard]] bool ends_field(const char* stop) const { return stop == line_end_ || *stop == ' ' || *stop == '\t'; }

    /// The field here, fit for a message: short, and without unprintable characters.
    [[nodiscard]] std::string field() const {
        std::string text;
        for (const char* c = at_; c != line_end_ && *c != ' ' && *c != '\t' && text.size() < 40; ++c) {
            text += std::isprint(static_cast<unsigned char>(*c)) != 0 ? *c : '?';
        }
        return text;
    }

    [[nodiscard]] std::string field_or_end() const {
        return at_ == line_end_ ? std::string("ended") : fmt::format("\"{}\"", field());
    }

    const char* next_line_;
    const char* end_;
    const char* at_ = nullptr;
    const char* line_end_ = nullptr;
    std::int64_t line_ = 0;
    const std::string& file_;
};

struct Header {
    bool integer = false;
    bool symmetric = false;
};

std::vector<std::string> lower_case_words(std::string_view line) {
    std::vector<std::string> words(1);
    for (const char c : line.substr(0, 200)) {
        if (c == ' ' || c == '\t') {
            if (!words.back().empty()) words.emplace_back();
        } else {
            words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        }
    }
    if (words.back().empty()) words.pop_back();
    return words;
}

Header read_banner(Scanner& scanner, const char* layout) {
    const std::vector<std::string> words = lower_case_words(scanner.banner());
    const std::string example = fmt::format("%%MatrixMarket matrix {} real general", layout);
    if (words.size() != 5 || words[0] != "%%matrixmarket" || words[1] != "matrix") {
        scanner.refuse("the file must begin with a line like \"{}\"", example);
    }
    if (words[2] != layout) scanner.refuse("the layout must be {}, as in \"{}\"", layout, example);
    if (words[3] != "real" && words[3] != "integer" && words[3] != "double") {
        scanner.refuse("the values must be real or integer, as in \"{}\"", example);
    }
    const bool may_be_symmetric = std::string_view(layout) == "coordinate";
    if (words[4] != "general" && !(may_be_symmetric && words[4] == "symmetric")) {
        scanner.refuse("the symmetry must be general{}, as in \"{}\"", may_be_symmetric ? " or symmetric" : "",
                       example);
    }
    return {words[3] == "integer", words[4] == "symmetric"};
}

struct Layout {
    bool symmetric = false;
    std::int64_t entries = 0;
};

/// Reads everything and calls on_entry(row, column, value, line), counted from 0, for each line of an entry;
/// on_layout(layout) comes before the first.
template <class OnLayout, class OnEntry>
void scan_matrix(Scanner& scanner, std::int32_t rows, std::int32_t columns, OnLayout on_layout, OnEntry on_entry) {
    const Header header = read_banner(scanner, "coordinate");
    if (!scanner.next_line()) scanner.refuse("the line \"rows columns entries\" is missing");
    const std::int64_t file_rows = scanner.integer("the number of rows");
    const std::int64_t file_columns = scanner.integer("the number of columns");
    const std::int64_t entries = scanner.integer("the number of entries");
    scanner.end_of_line("\"rows columns entries\"");
    if (file_rows != rows || file_columns != columns) {
        scanner.refuse("the matrix is {} × {}, but it must be {} × {}", file_rows, file_columns, rows, columns);
    }
    if (header.symmetric && rows != columns) scanner.refuse("a symmetric matrix must be square");
    // An entry takes at least six bytes: "1 1 1" and the end of the line, which only the last may lack.
    if (entries < 0 || entries > (scanner.bytes_left() + 1) / 6) {
        scanner.refuse("{} entries are announced, but the file has room for at most {}", entries,
                       (scanner.bytes_left() + 1) / 6);
    }
    if (entries > most_entries / (header.symmetric ? 2 : 1)) {
        scanner.refuse("{} entries are too many; at most {} can be held", entries, most_entries);
    }
    on_layout(Layout{header.symmetric, entries});
    for (std::int64_t k = 0; k < entries; ++k) {
        if (!scanner.next_line()) scanner.refuse("the file ends after {} of {} entries", k, entries);
        const std::int64_t row = scanner.integer("the row");
        const std::int64_t column = scanner.integer("the column");
        const double value = scanner.number(header.integer);
        scanner.end_of_line("\"row column value\"");
        if (row < 1 || row > rows) scanner.refuse("row {} is outside 1 to {}", row, rows);
        if (column < 1 || column > columns) scanner.refuse("column {} is outside 1 to {}", column, columns);
        if (header.symmetric && column > row) {
            scanner.refuse("row {}, column {} is above the diagonal; a symmetric file holds the lower triangle", row,
                           column);
        }
        on_entry(static_cast<std::int32_t>(row - 1), static_cast<std::int32_t>(column - 1), value, scanner.line());
    }
    if (scanner.next_line()) scanner.refuse("the file goes on after the {} entries that it announces", entries);
}

/// Sorts each row by columns. Returns the first row that holds a column twice, or −1.
std::int32_t sort_rows(SparseMatrix& matrix) {
    std::vector<std::pair<std::int32_t, double>> entries;
    for (std::int32_t row = 0; row < matrix.rows; ++row) {
        const auto begin = matrix.column.begin() + matrix.row_start[row];
        const auto end = matrix.column.begin() + matrix.row_start[row + 1];
        if (!std::is_sorted(begin, end)) {
            entries.clear();
            for (auto k = matrix.row_start[row]; k < matrix.row_start[row + 1]; ++k) {
                entries.emplace_back(matrix.column[k], matrix.value[k]);
            }
            std::sort(entries.begin(), entries.end(),
                      [](const auto& left, const auto& right) { return left.first < right.first; });
            for (std::size_t k = 0; k < entries.size(); ++k) {
                matrix.column[matrix.row_start[row] + k] = entries[k].first;
                matrix.value[matrix.row_start[row] + k] = entries[k].second;
            }
        }
        if (std::adjacent_find(begin, end) != end) return row;
    }
    return -1;
}

/// Reads the text a second time to say where the entry that repeats another stands.
[[noreturn]] void refuse_repeated(std::string_view text, const std::string& file, std::int32_t rows,
                                  std::int32_t columns, std::int32_t row, std::int32_t column) {
    std::int64_t first_line = 0;
    Scanner scanner(text, file);
    scan_matrix(
        scanner, rows, columns, [](const Layout&) {},
        [&](std::int32_t r, std::int32_t c, double, std::int64_t line) {
            const bool same = (r == row && c == column);
            if (same && first_line > 0) {
                scanner.refuse("row {}, column {} was given in line {} already", row + 1, column + 1, first_line);
            }
            if (same) first_line = line;
        });
    throw InputError(fmt::format("{}: row {}, column {} is given twice.", file, row + 1, column + 1));
}

void append(std::string& text, std::int64_t value) {
    char digits[24];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

void append(std::string& text, double value) {
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

}  // namespace

SparseMatrix parse_matrix_market(std::string_view text, const std::string& file, std::int32_t rows,
                                 std::int32_t columns) {
    std::vector<Triplet> triplets;
    bool symmetric = false;
    Scanner scanner(text, file);
    scan_matrix(
        scanner, rows, columns,
        [&](const Layout& layout) {
            symmetric = layout.symmetric;
            triplets.reserve(static_cast<std::size_t>(layout.entries));
        },
        [&](std::int32_t row, std::int32_t column, double value, std::int64_t) {
            triplets.push_back({row, column, value});
        });
    SparseMatrix matrix = SparseMatrix::zero(rows, columns);
    for (const Triplet& t : triplets) {
        ++matrix.row_start[t.row + 1];
        if (symmetric && t.row != t.column) ++matrix.row_start[t.column + 1];
    }
    std::partial_sum(matrix.row_start.begin(), matrix.row_start.end(), matrix.row_start.begin());
    matrix.column.resize(static_cast<std::size_t>(matrix.row_start.back()));
    matrix.value.resize(matrix.column.size());
    std::vector<std::int32_t> next(matrix.row_start.begin(), matrix.row_start.end() - 1);
    const auto place = [&](std::int32_t row, std::int32_t column, double value) {
        const std::int32_t k = next[row]++;
        matrix.column[k] = column;
        matrix.value[k] = value;
    };
    for (const Triplet& t : triplets) {
        place(t.row, t.column, t.value);
        if (symmetric && t.row != t.column) place(t.column, t.row, t.value);
    }
    const std::int32_t repeated = sort_rows(matrix);
    if (repeated >= 0) {
        const auto begin = matrix.column.begin() + matrix.row_start[repeated];
        const std::int32_t column = *std::adjacent_find(begin, matrix.column.begin() + matrix.row_start[repeated + 1]);
        refuse_repeated(text, file, rows, columns, symmetric ? std::max(repeated, column) : repeated,
                        symmetric ? std::min(repeated, column) : column);
    }
    return matrix;
}

std::vector<double> parse_vector_market(std::string_view text, const std::string& file, std::int32_t rows) {
    Scanner scanner(text, file);
    const Header header = read_banner(scanner, "array");
    if (!scanner.next_line()) scanner.refuse("the line \"rows 1\" is missing");
    const std::int64_t file_rows = scanner.integer("the number of rows");
    const std::int64_t file_columns = scanner.integer("the number of columns");
    scanner.end_of_line("\"rows 1\"");
    if (file_rows != rows || file_columns != 1) {
        scanner.refuse("the vector is {} × {}, but it must be {} × 1", file_rows, file_columns, rows);
    }
    if (file_rows > (scanner.bytes_left() + 1) / 2) {
        scanner.refuse("{} rows are announced, but the file has room for at most {}", file_rows,
                       (scanner.bytes_left() + 1) / 2);
    }
    std::vector<double> vector;
    vector.reserve(static_cast<std::size_t>(rows));
    for (std::int32_t k = 0; k < rows; ++k) {
        if (!scanner.next_line()) scanner.refuse("the file ends after {} of {} rows", k, rows);
        vector.push_back(scanner.number(header.integer));
        scanner.end_of_line("one number");
    }
    if (scanner.next_line()) scanner.refuse("the file goes on after the {} rows that it announces", rows);
    return vector;
}

std::string matrix_market_text(const SparseMatrix& matrix, bool may_be_symmetric) {
    bool symmetric = may_be_symmetric && matrix.rows == matrix.columns;
    if (symmetric) {
        // Bit by bit, and with the same pattern: 0 and −0, or 0 and no entry, would not come back as they are.
        const SparseMatrix transposed = matrix.transposed();
        symmetric = transposed.row_start == matrix.row_start && transposed.column == matrix.column &&
                    std::equal(matrix.value.begin(), matrix.value.end(), transposed.value.begin(),
                               [](double a, double b) { return a == b && std::signbit(a) == std::signbit(b); });
    }
    std::int64_t entries = matrix.entries();
    if (symmetric) {
        entries = 0;
        for (std::int32_t row = 0; row < matrix.rows; ++row) {
            for (std::int32_t k = matrix.row_start[row]; k < matrix.row_start[row + 1]; ++k) {
                entries += matrix.column[k] <= row ? 1 : 0;
            }
        }
    }
    std::string text = fmt::format("%%MatrixMarket matrix coordinate real {}\n{} {} {}\n",
                                   symmetric ? "symmetric" : "general", matrix.rows, matrix.columns, entries);
    text.reserve(text.size() + static_cast<std::size_t>(entries) * 32);
    for (std::int32_t row = 0; row < matrix.rows; ++row) {
        for (std::int32_t k = matrix.row_start[row]; k < matrix.row_start[row + 1]; ++k) {
            if (symmetric && matrix.column[k] > row) break;
            append(text, std::int64_t{row} + 1);
            text += ' ';
            append(text, std::int64_t{matrix.column[k]} + 1);
            text += ' ';
            append(text, matrix.value[k]);
            text += '\n';
        }
    }
    return text;
}

std::string vector_market_text(std::span<const double> vector) {
    std::string text = fmt::format("%%MatrixMarket matrix array real general\n{} 1\n", vector.size());
    text.reserve(text.size() + vector.size() * 24);
    for (const double value : vector) {
        append(text, value);
        text += '\n';
    }
    return text;
}

}  // namespace delassus
