// SPDX-License-Identifier: BSD-3-Clause
// Feeds bytes to the readers. The first byte chooses:
//   F    the rest says what to spoil in an FCLib HDF5 file that HDF5 itself finds sound: (dataset, size, values)…
//        HDF5's own robustness is not the target: it has little, so the library runs it in a child process.
//   else the rest is a problem folder: parts that begin with a line "=== <name of the file>"
// A reader may return a valid problem or throw InputError; everything else is a finding.
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "delassus/error.hpp"
#include "fclib/fclib.hpp"
#include "hdf5/hdf5.hpp"
#include "problem/problem_folder.hpp"

namespace {
namespace fs = std::filesystem;

/// One folder for the whole run, in memory where the system has such a place.
const fs::path& scratch() {
    static const fs::path path = [] {
        const fs::path root = fs::exists("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path();
        fs::path folder = root / ("delassus-fuzz-" + std::to_string(getpid()));
        fs::create_directories(folder);
        std::atexit([] {
            std::error_code ignored;
            fs::remove_all(scratch(), ignored);
        });
        return folder;
    }();
    return path;
}

void write_file(const fs::path& file, std::string_view content) {
    std::ofstream(file, std::ios::binary).write(content.data(), static_cast<std::streamsize>(content.size()));
}

void read_folder(std::string_view text) {
    const fs::path folder = scratch() / "problem";
    fs::remove_all(folder);
    fs::create_directory(folder);
    constexpr std::string_view mark = "=== ";
    while (text.substr(0, mark.size()) == mark) {
        text.remove_prefix(mark.size());
        const std::string_view name = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(name.size() + 1, text.size()));
        std::size_t end = text.find("\n=== ");
        end = end == std::string_view::npos ? text.size() : end + 1;
        for (const char* known : {"problem.json", "H.mtx", "D.mtx", "E.mtx", "a.mtx", "b.mtx"}) {
            if (name == known) write_file(folder / known, text.substr(0, end));
        }
        text.remove_prefix(end);
    }
    const delassus::Problem problem = delassus::read_problem_folder(folder);
    delassus::write_problem_folder(problem, scratch() / "copy");
    const delassus::Problem again = delassus::read_problem_folder(scratch() / "copy");
    if (again.H.value != problem.H.value || again.D.column != problem.D.column || again.E.value != problem.E.value ||
        again.a != problem.a || again.b != problem.b || again.cones.size() != problem.cones.size()) {
        std::fputs("what was written reads back otherwise\n", stderr);
        std::abort();
    }
}

constexpr const char* integer_datasets[] = {"spacedim", "M/m", "M/n", "M/nz", "M/p", "M/i",  "H/m", "H/n",
                                            "H/nz",     "H/p", "H/i", "G/m",  "G/n", "G/nz", "G/p", "G/i"};
constexpr const char* number_datasets[] = {"M/x", "H/x", "G/x", "vectors/f", "vectors/w", "vectors/b", "vectors/mu"};

/// The names of a global problem, or those that play the same part in a local one.
std::string path_of(const std::string& name, bool local) {
    if (!local) return "fclib_global/" + name;
    static const std::map<std::string, std::string> others = {{"vectors/w", "vectors/q"}, {"vectors/b", "vectors/s"}};
    const auto other = others.find(name);
    if (other != others.end()) return "fclib_local/" + other->second;
    std::string renamed = name;
    if (renamed[1] == '/') renamed[0] = renamed[0] == 'M' ? 'W' : renamed[0] == 'H' ? 'V' : 'R';
    return "fclib_local/" + renamed;
}

void put(hid_t file, const std::string& path, hid_t type, hsize_t size, const void* data) {
    const delassus::hdf5::Handle links(H5Pcreate(H5P_LINK_CREATE));
    H5Pset_create_intermediate_group(links.get(), 1);
    const delassus::hdf5::Handle space(H5Screate_simple(1, &size, nullptr));
    const delassus::hdf5::Handle set(
        H5Dcreate2(file, path.c_str(), type, space.get(), links.get(), H5P_DEFAULT, H5P_DEFAULT));
    if (size > 0) H5Dwrite(set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
}

void read_fclib(std::string_view spoil) {
    const bool local = !spoil.empty() && spoil[0] == 'L';
    std::map<std::string, std::vector<int>> integers = {
        {"spacedim", {2}},  {"M/m", {2}},          {"M/n", {2}},    {"M/nz", {-1}},
        {"M/p", {0, 2, 4}}, {"M/i", {0, 1, 0, 1}}, {"H/m", {2}},    {"H/n", {2}},
        {"H/nz", {-2}},     {"H/p", {0, 1, 2}},    {"H/i", {0, 1}}, {"G/m", {2}},
        {"G/n", {2}},       {"G/nz", {2}},         {"G/p", {0, 1}}, {"G/i", {0, 1}}};
    std::map<std::string, std::vector<double>> numbers = {
        {"M/x", {2, 1, 1, 3}}, {"H/x", {4, 5}},       {"G/x", {6, 7}},      {"vectors/f", {1, 2}},
        {"vectors/w", {3, 4}}, {"vectors/b", {5, 6}}, {"vectors/mu", {0.5}}};
    spoil.remove_prefix(spoil.empty() ? 0 : 1);
    const auto next = [&]() -> unsigned char {
        if (spoil.empty()) return 0;
        const char byte = spoil[0];
        spoil.remove_prefix(1);
        return static_cast<unsigned char>(byte);
    };
    while (!spoil.empty()) {
        const unsigned which = next() % (std::size(integer_datasets) + std::size(number_datasets));
        const unsigned size = next() % 8;
        const auto fill = [&](auto& values) {
            if (size == 7) return true;  // absent
            values.resize(size);
            for (auto& value : values) {
                // Mostly small numbers; sometimes any bits.
                const unsigned char byte = next();
                value = static_cast<std::remove_reference_t<decltype(value)>>(static_cast<signed char>(byte));
                if (byte != 0x7f) continue;
                auto* bytes = reinterpret_cast<unsigned char*>(&value);
                for (std::size_t k = 0; k < sizeof value; ++k) bytes[k] = next();
            }
            return false;
        };
        if (which < std::size(integer_datasets)) {
            if (fill(integers[integer_datasets[which]])) integers.erase(integer_datasets[which]);
        } else {
            const char* name = number_datasets[which - std::size(integer_datasets)];
            if (fill(numbers[name])) numbers.erase(name);
        }
    }
    const fs::path path = scratch() / "file.hdf5";
    {
        const delassus::hdf5::Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
        for (const auto& [name, values] : integers) {
            put(file.get(), path_of(name, local), H5T_NATIVE_INT, values.size(), values.data());
        }
        for (const auto& [name, values] : numbers) {
            put(file.get(), path_of(name, local), H5T_NATIVE_DOUBLE, values.size(), values.data());
        }
    }
    const delassus::Problem problem = delassus::fclib::read_file(path);
    const fs::path copy = scratch() / "copy.hdf5";
    fs::remove(copy);
    delassus::fclib::write_file(problem, copy, copy.string());
    const delassus::Problem again = delassus::fclib::read_file(copy);
    if (again.H.value != problem.H.value || again.D.column != problem.D.column || again.E.value != problem.E.value ||
        again.a != problem.a || again.b != problem.b || again.cones.size() != problem.cones.size()) {
        std::fputs("what was written to HDF5 reads back otherwise\n", stderr);
        std::abort();
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
    try {
        if (data[0] == 'F') {
            read_fclib(rest);
        } else {
            read_folder(rest);
        }
    } catch (const delassus::InputError&) {
        return 0;
    }
    return 0;
}
