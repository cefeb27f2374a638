// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "delassus/error.hpp"
#include "partitioned/bytes.hpp"
#include "partitioned/even_shares.hpp"
#include "problem_hdf5/problem_hdf5.hpp"
#include "problem_hdf5/shared_file.hpp"

namespace delassus::problem_hdf5 {

namespace {

/// Where the own entries of a vector stand in the file.
struct Places {
    std::int64_t total = 0;
    bool moved = false;                 ///< on any process; otherwise the own ones are a range
    std::int64_t first = 0, count = 0;  ///< of the range that this process reads and writes
    std::vector<std::int64_t> number;   ///< where moved: the number in the file of each own entry
};

Places places_of(const Communicator& communicator, const std::vector<std::int64_t>& start,
                 const std::vector<std::int64_t>& origin) {
    const auto own = static_cast<std::size_t>(communicator.rank());
    Places places;
    places.total = start.back();
    std::vector<std::int64_t> moved = {origin.empty() ? 0 : 1};
    communicator.max(moved);
    places.moved = moved[0] != 0;
    if (!places.moved) {
        places.first = start[own];
        places.count = start[own + 1] - start[own];
        return places;
    }
    const EvenShares shares{places.total, communicator.size()};
    places.first = shares.start(communicator.rank());
    places.count = shares.start(communicator.rank() + 1) - places.first;
    places.number = origin;
    if (origin.empty()) {
        places.number.resize(static_cast<std::size_t>(start[own + 1] - start[own]));
        std::iota(places.number.begin(), places.number.end(), start[own]);
    }
    return places;
}

/// The entries of the range that this process writes, from whoever has them.
std::vector<double> to_file(const Communicator& communicator, const Places& places, const std::vector<double>& own) {
    if (!places.moved) return own;
    const EvenShares shares{places.total, communicator.size()};
    const auto processes = static_cast<std::size_t>(communicator.size());
    std::vector<std::vector<std::int64_t>> numbers(processes);
    std::vector<std::vector<double>> values(processes);
    for (std::size_t k = 0; k < own.size(); ++k) {
        const auto p = static_cast<std::size_t>(shares.owner(places.number[k]));
        numbers[p].push_back(places.number[k]);
        values[p].push_back(own[k]);
    }
    std::vector<Bytes> to(processes);
    for (std::size_t p = 0; p < processes; ++p) {
        put(to[p], numbers[p]);
        put(to[p], values[p]);
    }
    std::vector<double> range(static_cast<std::size_t>(places.count), 0.0);
    for (const Bytes& bytes : communicator.exchange(to)) {
        ByteReader reader(bytes);
        const auto number = reader.next<std::int64_t>();
        const auto value = reader.next<double>();
        for (std::size_t k = 0; k < number.size(); ++k)
            range[static_cast<std::size_t>(number[k] - places.first)] = value[k];
    }
    return range;
}

/// The inverse of to_file().
std::vector<double> from_file(const Communicator& communicator, const Places& places, std::vector<double> range) {
    if (!places.moved) return range;
    const EvenShares shares{places.total, communicator.size()};
    const auto processes = static_cast<std::size_t>(communicator.size());
    std::vector<std::vector<std::int64_t>> wanted(processes);
    for (const auto number : places.number) wanted[static_cast<std::size_t>(shares.owner(number))].push_back(number);
    std::vector<Bytes> to(processes);
    for (std::size_t p = 0; p < processes; ++p) put(to[p], wanted[p]);
    const auto asked = communicator.exchange(to);
    for (std::size_t p = 0; p < processes; ++p) {
        ByteReader reader(asked[p]);
        std::vector<double> values;
        for (const auto number : reader.next<std::int64_t>())
            values.push_back(range[static_cast<std::size_t>(number - places.first)]);
        to[p].clear();
        put(to[p], values);
    }
    const auto answers = communicator.exchange(to);
    std::vector<std::vector<double>> values(processes);
    for (std::size_t p = 0; p < processes; ++p) values[p] = ByteReader(answers[p]).next<double>();
    std::vector<std::size_t> next(processes, 0);
    std::vector<double> own;
    own.reserve(places.number.size());
    for (const auto number : places.number) {
        const auto p = static_cast<std::size_t>(shares.owner(number));
        own.push_back(values[p][next[p]++]);
    }
    return own;
}

}  // namespace

void write_solution(const Communicator& communicator, const std::filesystem::path& path, const PartitionedProblem& part,
                    const std::vector<double>& x, const std::vector<double>& lambda, const std::string& report_json,
                    FileTraffic& traffic) {
    together(communicator, [&] {
        if (static_cast<std::int64_t>(x.size()) != part.n() || static_cast<std::int64_t>(lambda.size()) != part.m())
            throw InputError(fmt::format("the own part of the solution has {} and {} entries for n = {} and m = {}",
                                         x.size(), lambda.size(), part.n(), part.m()));
    });
    const Places columns = places_of(communicator, part.column_start, part.column_origin),
                 rows = places_of(communicator, part.row_start, part.row_origin);
    const auto x_range = to_file(communicator, columns, x), lambda_range = to_file(communicator, rows, lambda);
    const auto lay_out = [&](Writing& file) {
        file.text("format", solution_format);
        file.integer("version", format_version);
        file.text("problem", part.name);
        file.long_text("report", report_json);
        file.create("x", H5T_IEEE_F64LE, columns.total);
        file.create("lambda", H5T_IEEE_F64LE, rows.total);
    };
    const auto write_own = [&](Writing& file) {
        file.put("x", columns.first, x_range);
        file.put("lambda", rows.first, lambda_range);
    };
    write_in_turn(communicator, path, lay_out, write_own, traffic);
}

void read_solution(const Communicator& communicator, const std::filesystem::path& path, const PartitionedProblem& part,
                   Solution& own, FileTraffic& traffic) {
    const hdf5::Silence silence;
    const Places columns = places_of(communicator, part.column_start, part.column_origin),
                 rows = places_of(communicator, part.row_start, part.row_origin);
    together(communicator, [&] {
        if (communicator.rank() == 0) check_in_child(path, solution_format);
    });
    together(communicator, [&] {
        const OpenFile file(path, solution_format);
        file.root().require_only({"x", "lambda", "report"});
        const auto read = [&](const char* name, const Places& places) {
            const hdf5::Array array = file.root().number_array(name);
            if (array.count() != places.total)
                file.root().refuse(
                    fmt::format("/{} has {} elements, but the problem has {}", name, array.count(), places.total));
            std::vector<double> values(static_cast<std::size_t>(places.count));
            array.read(places.first, values);
            traffic.bytes_read += places.count * array.element_bytes();
            return values;
        };
        own.x = read("x", columns);
        own.lambda = read("lambda", rows);
        for (const auto* values : {&own.x, &own.lambda})
            for (const double value : *values)
                if (!std::isfinite(value)) file.root().refuse("it holds a value that is not finite");
    });
    own.x = from_file(communicator, columns, std::move(own.x));
    own.lambda = from_file(communicator, rows, std::move(own.lambda));
}

}  // namespace delassus::problem_hdf5
