// SPDX-License-Identifier: BSD-3-Clause
// Cones, problems and plugins.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "delassus/needs.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/qualification.hpp"
#include "delassus/rank.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver_config.hpp"
#include "guards.hpp"
#include "support/output_folder.hpp"

namespace delassus::python {

/// A prepared problem, and whose turn it is to use it.
struct SharedProblem {
    std::unique_ptr<PreparedProblem> prepared;
    Turn turn;

    explicit SharedProblem(Problem&& data) {
        const py::gil_scoped_release without_gil;
        for (SparseMatrix* matrix : {&data.H, &data.D, &data.E}) {
            matrix->row_start.share();
            matrix->column.share();
            matrix->value.share();
        }
        prepared = std::make_unique<PreparedProblem>(std::move(data));
    }
    explicit SharedProblem(PreparedProblem&& made) : prepared(std::make_unique<PreparedProblem>(std::move(made))) {}
    [[nodiscard]] const Problem& data() const { return prepared->problem(); }
};

/// Names the problem that this thread has a solver work with, as long as it lives.
class ProblemInUse {
public:
    explicit ProblemInUse(const PreparedProblem& problem) : before_(std::exchange(slot(), &problem)) {}
    ~ProblemInUse() { slot() = before_; }
    ProblemInUse(const ProblemInUse&) = delete;
    ProblemInUse& operator=(const ProblemInUse&) = delete;
    /// Null where there is none.
    static const PreparedProblem* now() { return slot(); }

private:
    static const PreparedProblem*& slot() {
        thread_local const PreparedProblem* problem = nullptr;
        return problem;
    }
    const PreparedProblem* before_;
};

/// A problem on its way to the class of Python that users know.
struct Handover {
    std::unique_ptr<SharedProblem> problem;
};

inline bool is_problem(const py::object& object) {
    return py::isinstance<SharedProblem>(object);
}

inline void check_shape(const SparseMatrix& matrix, const char* name, std::int32_t rows, std::int32_t columns,
                        const char* sizes) {
    if (matrix.rows != rows || matrix.columns != columns)
        throw InputError(fmt::format("{} is {} × {}; it must be {} = {} × {}, as a has n and b has m entries", name,
                                     matrix.rows, matrix.columns, sizes, rows, columns));
}

inline std::unique_ptr<SharedProblem> make_problem(const py::object& H, const py::object& D, const py::array& a,
                                                   const py::array& b, const std::vector<Cone>& cones,
                                                   const py::object& E, const std::string& law, const std::string& name,
                                                   bool copy) {
    Lender lender(copy);
    Problem data;
    data.name = name;
    data.a = reals_of(a, "a", lender);
    data.b = reals_of(b, "b", lender);
    data.cones = cones;
    data.law = law_of(law);
    const auto take = [&lender](const py::object& parts, SparseMatrix& matrix, const char* letter, std::int32_t rows,
                                std::int32_t columns, const char* sizes) {
        if (parts.is_none()) return;
        matrix = matrix_of(py::tuple(parts), letter, lender);
        check_shape(matrix, letter, rows, columns, sizes);
    };
    take(H, data.H, "H", data.n(), data.n(), "n × n");
    take(D, data.D, "D", data.m(), data.n(), "m × n");
    take(E, data.E, "E", data.m(), data.m(), "m × m");
    auto problem = std::make_unique<SharedProblem>(std::move(data));
    lender.keep();
    return problem;
}

inline py::tuple parts_of(const SparseMatrix& matrix, const py::object& owner) {
    return py::make_tuple(view_of(matrix.value, owner), view_of(matrix.column, owner), view_of(matrix.row_start, owner),
                          py::make_tuple(matrix.rows, matrix.columns));
}

/// As `delassus inspect --json` has it.
inline py::dict inspect(SharedProblem& problem, const Registry& registry) {
    struct Found {
        std::optional<std::int32_t> rank;
        std::vector<std::string> needs, capable;
        Law law;
    };
    const PreparedProblem& prepared = *problem.prepared;
    const Found found = in_turn(problem.turn, [&] {
        return Found{estimate_rank(prepared.problem()), capability_names(prepared.needs()),
                     registry.capable(prepared.needs()), prepared.problem().law};
    });
    const Problem& data = prepared.problem();
    py::dict cones;
    for (const Cone& cone : data.cones) {
        const py::str kind{std::string(name_of(cone.kind))};
        if (!cones.contains(kind)) {
            py::dict count;
            count["blocks"] = 0;
            count["rows"] = 0;
            cones[kind] = count;
        }
        const py::dict count = cones[kind];
        count["blocks"] = count["blocks"].cast<std::int64_t>() + 1;
        count["rows"] = count["rows"].cast<std::int64_t>() + cone.rows;
    }
    py::dict entries, result;
    entries["H"] = data.H.entries();
    entries["D"] = data.D.entries();
    entries["E"] = data.E.entries();
    result["problem"] = data.name;
    result["n"] = data.n();
    result["m"] = data.m();
    result["law"] = std::string(name_of(found.law));
    result["structure"] = std::string(name_of(prepared.structure()));
    result["h_blocks"] = prepared.raw().h_block_count;
    result["entries"] = entries;
    result["cones"] = cones;
    result["rank"] = found.rank;
    result["needs"] = found.needs;
    result["capable"] = found.capable;
    result["source"] = data.source;
    result["notes"] = data.notes;
    return result;
}

inline py::object answer_of(Answer answer) {
    return answer == Answer::Undecided ? py::object(py::none()) : py::object(py::bool_(answer == Answer::Yes));
}

inline py::dict qualification(SharedProblem& problem, const Registry& registry) {
    Qualification found = in_turn(problem.turn, [&] { return qualify(problem.data(), registry); });
    py::dict result;
    result["licq"] = answer_of(found.independent);
    result["rank"] = found.rank;
    result["free_rows"] = found.free_rows;
    result["free_rank"] = found.free_rank;
    result["pointed"] = answer_of(found.pointed);
    result["pointedness"] = found.pointedness;
    result["cancelling"] = array_of(std::move(found.cancelling));
    return result;
}

inline std::optional<bool> optimized_of(const PluginInfo& info) {
    if (info.build == DELASSUS_BUILD_UNKNOWN) return std::nullopt;
    return info.build == DELASSUS_BUILD_OPTIMIZED;
}

inline py::list plugins(const Registry& registry) {
    constexpr const char* types[] = {"boolean", "integer", "real", "choice", "text"};
    py::list result;
    auto infos = registry.plugins();
    const auto packaged = registry.packaged();
    infos.insert(infos.end(), packaged.begin(), packaged.end());
    for (const PluginInfo& info : infos) {
        py::dict options, plugin;
        for (const OptionInfo& option : info.options) {
            py::dict row;
            row["type"] = types[option.type];
            row["default"] = option.default_value;
            row["domain"] = option.domain();
            row["unit"] = option.unit;
            row["doc"] = option.doc;
            options[py::str(option.key)] = row;
        }
        plugin["name"] = info.name;
        plugin["version"] = info.version;
        plugin["description"] = info.description;
        plugin["licence"] = info.licence;
        plugin["capabilities"] = capability_names(info.capabilities);
        plugin["options"] = options;
        plugin["library"] = info.library.string();
        plugin["optimized"] = optimized_of(info);
        plugin["origin"] = std::string(name_of(info.origin));
        plugin["installed_from"] = info.installed_from;
        result.append(plugin);
    }
    return result;
}

inline py::list rejected(const Registry& registry) {
    py::list result;
    for (const RejectedPlugin& row : registry.rejected()) {
        py::dict plugin;
        plugin["name"] = row.name;
        plugin["path"] = row.path.string();
        plugin["reason"] = row.reason;
        result.append(plugin);
    }
    return result;
}

inline std::string text_of(const Cone& cone) {
    const std::string kind(name_of(cone.kind));
    if (cone.kind == ConeKind::Friction)
        return fmt::format("Cone.friction({}, rows={})", cone.parameters[0], cone.rows);
    if (cone.kind == ConeKind::Box)
        return fmt::format("Cone.box([{}], [{}])", fmt::join(cone.lo, ", "), fmt::join(cone.hi, ", "));
    return fmt::format("Cone.{}({})", kind, cone.rows);
}

inline void bind_problems(py::module_& module) {
    using namespace py::literals;

    py::class_<Registry, std::shared_ptr<Registry>>(module, "Registry", "The plugins that can be chosen by name.")
        .def(py::init([](const std::vector<std::string>& folders) {
                 return std::make_shared<Registry>(std::vector<std::filesystem::path>(folders.begin(), folders.end()));
             }),
             "folders"_a = std::vector<std::string>{})
        .def("plugins", &plugins)
        .def("rejected", &rejected)
        .def("_add", [](Registry& registry, std::shared_ptr<Plugin> plugin) { registry.add(std::move(plugin)); })
        .def("unbuilt", [](const Registry& registry) {
            std::map<std::string, std::string> reasons;
            for (const auto& plugin : registry.unbuilt()) reasons.emplace(plugin.name, plugin.reason);
            return reasons;
        });

    py::class_<Cone>(module, "Cone",
                     "A block of rows with its cone Υ. λ and u of the block satisfy λ ∈ Υ ⊥ u ∈ Υ*; made by "
                     "Cone.free, Cone.nonnegative, Cone.box or Cone.friction.")
        .def_static("free", &Cone::free, "rows"_a = 1, "Bilateral constraints: λ is free, u = 0.")
        .def_static("nonnegative", &Cone::nonnegative, "rows"_a = 1, "Contacts without friction, stops: λ ≥ 0, u ≥ 0.")
        .def_static("box", &Cone::box, "lo"_a, "hi"_a,
                    "Bounded reactions, lo ≤ λ ≤ hi (as motors with a limit); one bound for each row, ±inf allowed.")
        .def_static("friction", &Cone::friction, "mu"_a, "rows"_a = 3,
                    "A contact with friction, ‖λ_t‖ ≤ mu λ_n: the normal row first; rows = 3, or 2 in the plane.")
        .def_property_readonly("kind", [](const Cone& cone) { return std::string(name_of(cone.kind)); })
        .def_readonly("rows", &Cone::rows)
        .def_property_readonly(
            "mu",
            [](const Cone& cone) {
                return cone.kind == ConeKind::Friction ? std::optional(cone.parameters[0]) : std::nullopt;
            },
            "The coefficient of friction; None for other kinds.")
        .def_property_readonly("lo", [](const Cone& cone) { return array_of(std::vector(cone.lo)); })
        .def_property_readonly("hi", [](const Cone& cone) { return array_of(std::vector(cone.hi)); })
        .def("__repr__", &text_of);

    py::class_<Handover>(module, "_Handover");  // NOLINT(bugprone-unused-raii)
    const auto matrix = [](const SparseMatrix Problem::*member) {
        return [member](const py::object& self) { return parts_of(self.cast<SharedProblem&>().data().*member, self); };
    };
    py::class_<SharedProblem>(module, "Problem")
        .def(py::init(&make_problem), "H"_a, "D"_a, "a"_a, "b"_a, "cones"_a, "E"_a, "law"_a, "name"_a, "copy"_a)
        .def(py::init([](const std::string& path) {
                 Problem data;
                 {
                     const py::gil_scoped_release without_gil;
                     data = read_problem(path);
                 }
                 return std::make_unique<SharedProblem>(std::move(data));
             }),
             "path"_a)
        .def(py::init([](Handover& prepared) { return std::move(prepared.problem); }))
        .def_property_readonly("_H", matrix(&Problem::H))
        .def_property_readonly("_D", matrix(&Problem::D))
        .def_property_readonly("_E", matrix(&Problem::E))
        .def_property_readonly(
            "a",
            [](SharedProblem& self) { return array_of(in_turn(self.turn, [&] { return vector_of(self.data().a); })); },
            "The right-hand side of the balance, n; a copy.")
        .def_property_readonly(
            "b",
            [](SharedProblem& self) { return array_of(in_turn(self.turn, [&] { return vector_of(self.data().b); })); },
            "The constant part of the constraint velocities, m; a copy.")
        .def_property_readonly("cones", [](const SharedProblem& self) { return self.data().cones; })
        .def_property_readonly(
            "n", [](const SharedProblem& self) { return self.data().n(); }, "Velocities.")
        .def_property_readonly(
            "m", [](const SharedProblem& self) { return self.data().m(); }, "Rows of constraints.")
        .def_property_readonly("name", [](const SharedProblem& self) { return self.data().name; })
        .def_property(
            "law",
            [](SharedProblem& self) {
                return std::string(name_of(in_turn(self.turn, [&] { return self.data().law; })));
            },
            [](SharedProblem& self, const std::string& law) {
                in_turn(self.turn, [&] { self.prepared->set_law(law_of(law)); });
            },
            "The law of friction: 'associated' or 'coulomb'.")
        .def_property_readonly(
            "structure", [](const SharedProblem& self) { return std::string(name_of(self.prepared->structure())); },
            "The structure of H, detected from its values.")
        .def(
            "set_right_hand_side",
            [](SharedProblem& self, const Reals& a, const Reals& b) {
                auto new_a = vector_of(a, "a"), new_b = vector_of(b, "b");
                in_turn(self.turn, [&] { self.prepared->set_right_hand_side(std::move(new_a), std::move(new_b)); });
            },
            "a"_a, "b"_a, "Replace a (n) and b (m); what solvers analysed or factorised stays valid.")
        .def("_write", [](SharedProblem& self,
                          const std::string& path) { in_turn(self.turn, [&] { write_problem(self.data(), path); }); })
        .def("_inspect", &inspect)
        .def("_qualification", &qualification)
        .def("_errors", [](SharedProblem& self, const Reals& x, const Reals& lambda) {
            const auto x_values = vector_of(x, "x"), lambda_values = vector_of(lambda, "lam");
            const Errors found =
                in_turn(self.turn, [&] { return self.prepared->meter().measure(x_values, lambda_values); });
            py::dict result;
            for (const ErrorMeasure& measure : error_measures)
                result[py::str(std::string(measure.name))] = found.*measure.value;
            return result;
        });
    module.def(
        "fill_folder",
        [](const std::string& path, const std::string& kind, const std::vector<std::string>& names) {
            OutputFolder folder(path, kind);
            for (const auto& name : names) {
                if (name.ends_with('/')) {
                    folder.add_folder(name.substr(0, name.size() - 1));
                } else {
                    folder.add(name);
                }
            }
            folder.keep();
        },
        "Makes room for these names in a folder that a command of this kind fills; folders end in a slash.");
}

}  // namespace delassus::python
