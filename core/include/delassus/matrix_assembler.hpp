// SPDX-License-Identifier: BSD-3-Clause
// Sparse matrices that are assembled again and again with the same pattern.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// Adds up entries into a SparseMatrix. It remembers the order of the places: as long as the next assembly adds to the
/// same places in the same order, whatever the values, nothing is sorted and nothing is allocated.
class MatrixAssembler {
public:
    /// Starts an assembly of rows × columns; the values of the last one are dropped.
    DELASSUS_API void begin(std::int32_t rows, std::int32_t columns);

    /// Adds value at a place, 0 ≤ row < rows and 0 ≤ column < columns (not checked). Zeros make entries too; add them
    /// for a pattern that lasts.
    void add(std::int32_t row, std::int32_t column, double value) {
        const Place place{row, column};
        if (count_ == places_.size()) {
            places_.push_back(place);
            values_.push_back(value);
            repeats_ = false;
        } else {
            if (!(places_[count_] == place)) {
                places_[count_] = place;
                repeats_ = false;
            }
            values_[count_] = value;
        }
        ++count_;
    }

    /// Adds factor · block at (row, column); block is row-major, rows × columns.
    void add_block(std::int32_t row, std::int32_t column, std::int32_t rows, std::int32_t columns, const double* block,
                   double factor = 1.0) {
        for (std::int32_t i = 0; i < rows; ++i)
            for (std::int32_t j = 0; j < columns; ++j) add(row + i, column + j, factor * block[i * columns + j]);
    }

    /// Adds factor · g gᵀ, where g has these values in these columns, which ascend.
    void add_product(std::span<const std::int32_t> columns, std::span<const double> g, double factor) {
        if (keeps_products_) {
            products_.push_back({factor, product_columns_.size(), columns.size()});
            product_columns_.insert(product_columns_.end(), columns.begin(), columns.end());
            product_values_.insert(product_values_.end(), g.begin(), g.end());
            return;
        }
        for (std::size_t i = 0; i < columns.size(); ++i)
            for (std::size_t j = 0; j < columns.size(); ++j) add(columns[i], columns[j], factor * (g[i] * g[j]));
    }
    /// From now on products are not added: for_each_product() has them.
    void keep_products() { keeps_products_ = true; }
    /// visit(columns, g, factor) for those of this assembly.
    template <class Visit>
    void for_each_product(Visit&& visit) const {
        for (const Product& product : products_)
            visit(std::span(product_columns_).subspan(product.first, product.size),
                  std::span(product_values_).subspan(product.first, product.size), product.factor);
    }

    /// Adds factor · matrix, of the size of this one.
    DELASSUS_API void add_matrix(const SparseMatrix& matrix, double factor = 1.0);

    /// The matrix; valid until the next begin(). Throws InputError if a place lies outside.
    [[nodiscard]] DELASSUS_API const SparseMatrix& finish();

    /// The same into another matrix, whose arrays are reused. Throws likewise.
    DELASSUS_API void finish_into(SparseMatrix& matrix);

    /// How often a pattern was built: grows by one whenever finish() met new places.
    [[nodiscard]] std::int64_t patterns() const { return patterns_; }

private:
    /// slot_ and the pattern of matrix_, for the places that were added.
    void find_pattern();
    /// values ← the sums; their number is that of the pattern.
    void sum_up(Array<double>& values) const;

    struct Place {
        std::int32_t row, column;
        bool operator==(const Place&) const = default;
    };
    std::vector<Place> places_;
    std::vector<double> values_;
    std::vector<std::int32_t> slot_;  // of each place in the matrix's values
    std::size_t count_ = 0;
    bool repeats_ = false;  // all places so far are those of the last assembly
    struct Product {
        double factor;
        std::size_t first, size;
    };
    bool keeps_products_ = false;
    std::vector<Product> products_;
    std::vector<std::int32_t> product_columns_;
    std::vector<double> product_values_;
    std::int64_t patterns_ = 0;
    SparseMatrix matrix_;
};

}  // namespace delassus
