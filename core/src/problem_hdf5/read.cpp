// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "partitioned/even_shares.hpp"
#include "problem/cone_kinds.hpp"
#include "problem/structure.hpp"
#include "problem_hdf5/problem_hdf5.hpp"

namespace delassus::problem_hdf5 {

using Cut = ProblemFile::Cut;

namespace {

/// Where every process begins, and the end; starts that would go back, as a damaged file may have them, do not.
std::vector<Cut> cuts_of_all(const Communicator& communicator, const Cut& own, const Cut& end) {
    std::vector<Cut> cuts(static_cast<std::size_t>(communicator.size()));
    for (auto member : {&Cut::column, &Cut::cone, &Cut::row, &Cut::body}) {
        const auto values = communicator.all(own.*member);
        for (std::size_t p = 0; p < cuts.size(); ++p)
            cuts[p].*member = p == 0 ? 0 : std::clamp(values[p], cuts[p - 1].*member, end.*member);
    }
    cuts.push_back(end);
    return cuts;
}

/// Whether no process gets much more than its share; what bodies and cones need to stay whole is allowed on top.
bool are_balanced(const std::vector<Cut>& cuts, const Cut& end) {
    constexpr std::int64_t grain = 64;
    const auto processes = static_cast<std::int64_t>(cuts.size()) - 1;
    for (std::size_t p = 0; p + 1 < cuts.size(); ++p) {
        const std::int64_t columns = cuts[p + 1].column - cuts[p].column, rows = cuts[p + 1].row - cuts[p].row;
        if (4 * (columns + rows - grain) * processes > 5 * (end.column + end.row)) return false;
        if (2 * (columns - grain) * processes > 3 * end.column || 2 * (rows - grain) * processes > 3 * end.row)
            return false;
    }
    return true;
}

std::vector<std::int64_t> starts(const std::vector<Cut>& cuts, std::int64_t Cut::*member) {
    std::vector<std::int64_t> values;
    for (const Cut& cut : cuts) values.push_back(cut.*member);
    return values;
}

}  // namespace

void read(const Communicator& communicator, const std::filesystem::path& path, PartitionedProblem& part,
          FileTraffic& traffic) {
    const hdf5::Silence silence;
    const int rank = communicator.rank(), size = communicator.size();
    together(communicator, [&] {
        if (rank == 0) check_in_child(path, problem_format);
    });
    std::optional<ProblemFile> file;
    Cut by_bodies, evenly;
    bool whole = false;
    together(communicator, [&] {
        file.emplace(path);
        whole = file->has_bodies_and_cones();
        if (whole) by_bodies = file->cut_by_bodies(rank, size);
        evenly = file->cut_evenly(rank, size);
    });
    auto cuts = cuts_of_all(communicator, evenly, file->end());
    if (whole) {
        const auto better = cuts_of_all(communicator, by_bodies, file->end());
        if (are_balanced(better, file->end())) cuts = better;
    }
    together(communicator, [&] {
        part.name = path.stem().string();
        part.law = file->law();
        part.source = file->text("source");
        part.notes = file->text("notes");
        part.column_start = starts(cuts, &Cut::column);
        part.row_start = starts(cuts, &Cut::row);
        part.cone_start = starts(cuts, &Cut::cone);
        const auto own = static_cast<std::size_t>(rank);
        file->read_slice(cuts[own], cuts[own + 1], part);
        traffic.bytes_read += file->bytes_read();
    });
    try {
        validate(communicator, part);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", path.string(), error.what()));
    }
}

namespace {

/// Goes through rows of H and finds its diagonal blocks, as runs of rows that no entry leaves.
class BlockScan {
public:
    void add(const LocalMatrix& rows, std::int64_t first_row) {
        for (std::int64_t row = 0; row < rows.rows; ++row) add_row(rows, row, first_row + row);
    }
    void finish() { close(); }

    std::int64_t largest = 0;
    bool definite_blocks = true, symmetric_blocks = true, positive_diagonal = true;
    /// Σ of hashes of entries above the diagonal, less those below with places exchanged: 0 if symmetric.
    std::uint64_t asymmetry = 0;

private:
    static std::uint64_t hash_of(std::int64_t row, std::int64_t column, double value) {
        Hash hash;
        hash.add(&row, sizeof row);
        hash.add(&column, sizeof column);
        hash.add(&value, sizeof value);
        return hash.value();
    }

    void add_row(const LocalMatrix& rows, std::int64_t local, std::int64_t row) {
        if (row > reach_) close();
        if (block_.empty()) begin_ = reach_ = row;
        double diagonal = 0.0;
        for (auto k = rows.row_start[static_cast<std::size_t>(local)];
             k < rows.row_start[static_cast<std::size_t>(local) + 1]; ++k) {
            const auto column = rows.column[static_cast<std::size_t>(k)];
            const double value = rows.value[static_cast<std::size_t>(k)];
            if (column == row) diagonal = value;
            if (column > row) asymmetry += hash_of(row, column, value);
            if (column < row) asymmetry -= hash_of(column, row, value);
            reach_ = std::max(reach_, column);
            if (reach_ - begin_ < largest_inertia_block) block_.push_back({row, column, value});
        }
        if (!(diagonal > 0.0)) positive_diagonal = false;
        if (block_.empty()) block_.push_back({row, row, 0.0});
    }

    void close() {
        if (block_.empty()) return;
        const std::int64_t size = reach_ - begin_ + 1;
        largest = std::max(largest, size);
        if (size <= largest_inertia_block) {
            Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
            for (const Entry& entry : block_)
                if (entry.column >= begin_) dense(entry.row - begin_, entry.column - begin_) = entry.value;
            if (dense != dense.transpose()) symmetric_blocks = false;
            if (Eigen::LLT<Eigen::MatrixXd>(dense).info() != Eigen::Success) definite_blocks = false;
        }
        block_.clear();
    }

    struct Entry {
        std::int64_t row, column;
        double value;
    };
    std::vector<Entry> block_;
    std::int64_t begin_ = 0, reach_ = -1;
};

}  // namespace

void inspect(const Communicator& communicator, const std::filesystem::path& path, PartitionedFileSummary& summary) {
    const hdf5::Silence silence;
    const int rank = communicator.rank(), size = communicator.size();
    constexpr std::int64_t piece = 1 << 18;
    together(communicator, [&] {
        if (rank == 0) check_in_child(path, problem_format);
    });
    BlockScan scan;
    std::vector<std::int64_t> counts(2 * sdk::cone_table.size(), 0);
    together(communicator, [&] {
        const ProblemFile file(path);
        summary.name = path.stem().string();
        summary.law = file.law();
        summary.source = file.text("source");
        summary.notes = file.text("notes");
        summary.n = file.n();
        summary.m = file.m();
        summary.cone_count = file.cone_count();
        summary.body_count = file.body_count();
        summary.H_entries = file.entries("H");
        summary.D_entries = file.entries("D");
        summary.E_entries = file.entries("E");
        summary.file_bytes = file.file().bytes();
        const EvenShares cones{file.cone_count(), size}, columns{file.n(), size};
        for (auto first = cones.start(rank); first < cones.start(rank + 1); first += piece) {
            const auto shapes = file.cone_shapes(first, std::min(first + piece, cones.start(rank + 1)));
            for (std::size_t k = 0; k < shapes.kind.size(); ++k) {
                ++counts[2 * static_cast<std::size_t>(shapes.kind[k])];
                counts[2 * static_cast<std::size_t>(shapes.kind[k]) + 1] +=
                    shapes.row_start[k + 1] - shapes.row_start[k];
            }
        }
        const auto end = file.after_block(columns.start(rank + 1));
        for (auto first = file.after_block(columns.start(rank)); first < end; first += piece)
            scan.add(file.rows_of("H", first, std::min(first + piece, end)), first);
        scan.finish();
    });
    communicator.sum(counts);
    for (std::size_t kind = 0; kind < sdk::cone_table.size(); ++kind)
        if (counts[2 * kind] > 0)
            summary.cones[std::string(sdk::cone_table[kind].name)] = {counts[2 * kind], counts[2 * kind + 1]};
    std::vector<std::int64_t> found = {scan.largest, !scan.definite_blocks, !scan.symmetric_blocks,
                                       !scan.positive_diagonal};
    communicator.max(found);
    // Sums of 64-bit hashes, which wrap; a process has no other way to see the entry on the other side.
    std::uint64_t asymmetry = 0;
    for (const auto part : communicator.all(static_cast<std::int64_t>(scan.asymmetry)))
        asymmetry += static_cast<std::uint64_t>(part);
    if (summary.n == 0) return;
    summary.largest_block = found[0];
    const bool symmetric = asymmetry == 0 && found[2] == 0;
    if (!symmetric) {
        summary.structure = Structure::Unsymmetric;
    } else if (found[3] != 0) {
        summary.structure = Structure::Indefinite;
    } else if (found[0] == 1) {
        summary.structure = Structure::Diagonal;
    } else if (found[0] <= largest_inertia_block) {
        summary.structure = found[1] == 0 ? Structure::Blocks : Structure::Indefinite;
    } else {
        summary.structure = Structure::Definite;
    }
}

}  // namespace delassus::problem_hdf5
