// SPDX-License-Identifier: BSD-3-Clause
#include "problem/problem_folder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>

#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "problem/matrix_market.hpp"
#include "problem/problem_json.hpp"
#include "support/atomic_file.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace fs = std::filesystem;
namespace {

/// The longest vector of zeros that problem.json may ask for without a file for it.
constexpr std::int32_t most_rows_without_file = 1'000'000;

bool present(const fs::path& file) {
    std::error_code error;
    return fs::exists(fs::symlink_status(file, error));
}

std::vector<double> read_vector_or_zero(const fs::path& file, std::int32_t rows, const fs::path& json, char size_name) {
    if (present(file)) return parse_vector_market(read_file(file), file.string(), rows);
    if (rows > most_rows_without_file) {
        throw InputError(fmt::format("{}: {} is {}, but there is no {}, which may be absent (all zero) up to {} rows.",
                                     json.string(), size_name, rows, file.filename().string(), most_rows_without_file));
    }
    return std::vector<double>(static_cast<std::size_t>(rows), 0.0);
}

SparseMatrix read_matrix_or(const fs::path& file, std::int32_t rows, std::int32_t columns, SparseMatrix if_absent) {
    return present(file) ? parse_matrix_market(read_file(file), file.string(), rows, columns) : std::move(if_absent);
}

bool needs_file(std::span<const double> vector) {
    if (vector.size() > static_cast<std::size_t>(most_rows_without_file)) return true;
    for (const double value : vector) {
        if (value != 0.0 || std::signbit(value)) return true;
    }
    return false;
}

void require_folder(const fs::path& folder, const char* wanted) {
    std::error_code error;
    if (!fs::exists(folder, error)) throw InputError(fmt::format("{}: there is no such folder.", folder.string()));
    if (!fs::is_directory(folder, error)) {
        throw InputError(fmt::format("{} is not {}.", folder.string(), wanted));
    }
}

}  // namespace

std::string problem_name(const fs::path& path, bool strip_extension) {
    std::error_code error;
    fs::path clean = fs::weakly_canonical(path, error);
    if (error) clean = path.lexically_normal();
    if (!clean.has_filename()) clean = clean.parent_path();
    return strip_extension ? clean.stem().string() : clean.filename().string();
}

Problem read_problem_folder(const fs::path& folder) {
    require_folder(folder, "a problem folder (or an HDF5 file that ends in .h5 or .hdf5)");
    const fs::path json_file = folder / "problem.json";
    if (!present(json_file)) {
        throw InputError(fmt::format("{} holds no problem.json, so it is not a problem folder.", folder.string()));
    }
    const ProblemJson json = parse_problem_json(read_file(json_file), json_file.string());
    const std::int32_t n = json.n;
    const std::int32_t m = json.m;
    Problem problem;
    problem.name = problem_name(folder, false);
    // The vectors first: they prove that n and m are honest, before anything else of that size is made.
    problem.a = read_vector_or_zero(folder / "a.mtx", n, json_file, 'n');
    problem.b = read_vector_or_zero(folder / "b.mtx", m, json_file, 'm');
    problem.H = read_matrix_or(folder / "H.mtx", n, n, SparseMatrix::zero(n, n));
    problem.D = read_matrix_or(folder / "D.mtx", m, n, n > 0 && m > 0 ? SparseMatrix::zero(m, n) : SparseMatrix());
    problem.E = read_matrix_or(folder / "E.mtx", m, m, SparseMatrix());
    problem.cones = expand_cones(json);
    problem.law = json.law;
    problem.source = json.source;
    problem.notes = json.notes;
    try {
        validate(problem);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", folder.string(), error.what()));
    }
    return problem;
}

void write_problem_folder(const Problem& problem, const fs::path& folder) {
    const std::string json = problem_json_text(problem);
    AtomicFolder target(folder, "problem");
    const auto write = [&](const char* name, const std::string& text) {
        write_file_atomically(target.path() / name, text);
    };
    write("problem.json", json);
    if (problem.H.entries() > 0) write("H.mtx", matrix_market_text(problem.H, true));
    if (problem.D.entries() > 0) write("D.mtx", matrix_market_text(problem.D, false));
    if (problem.E.entries() > 0) write("E.mtx", matrix_market_text(problem.E, true));
    if (needs_file(problem.a)) write("a.mtx", vector_market_text(problem.a));
    if (needs_file(problem.b)) write("b.mtx", vector_market_text(problem.b));
    target.commit();
}

Solution read_solution(const fs::path& folder, std::int32_t n, std::int32_t m) {
    require_folder(folder, "a solution folder");
    const auto read = [&](const char* name, std::int32_t rows) {
        const fs::path file = folder / name;
        if (rows == 0 && !present(file)) return std::vector<double>();
        return parse_vector_market(read_file(file), file.string(), rows);
    };
    return {read("x.mtx", n), read("lambda.mtx", m)};
}

void write_solution(const Solution& solution, const std::string& report, const fs::path& folder) {
    for (const auto& [name, vector] : {std::pair("x", &solution.x), std::pair("lambda", &solution.lambda)}) {
        for (std::size_t k = 0; k < vector->size(); ++k) {
            if (!std::isfinite((*vector)[k])) {
                throw InputError(fmt::format("{} cannot be written: {}[{}] is {}, but a solution must be finite.",
                                             folder.string(), name, k, (*vector)[k]));
            }
        }
    }
    AtomicFolder target(folder, "solution");
    write_file_atomically(target.path() / "x.mtx", vector_market_text(solution.x));
    write_file_atomically(target.path() / "lambda.mtx", vector_market_text(solution.lambda));
    if (!report.empty()) write_file_atomically(target.path() / "report.json", report);
    target.commit();
}

}  // namespace delassus
