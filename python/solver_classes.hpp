// SPDX-License-Identifier: BSD-3-Clause
// Solvers that are classes of Python: plugins whose operations call the methods of an object.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "delassus/needs.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "problems.hpp"
#include "solver/create_slots.hpp"

namespace delassus::python {

/// A class of Python and its plugin. It lasts as long as the process, as what Python still refers to does.
struct SolverClass {
    py::object type;
    std::string name, version, description, licence;
    std::vector<OptionInfo> rows;
    std::vector<delassus_option> options;
    delassus_plugin_descriptor descriptor{};
};

/// The classes so far, by the numbers of their create().
inline std::vector<SolverClass*>& solver_classes() {
    static auto* const classes = new std::vector<SolverClass*>;
    return *classes;
}

/// What Python sees of a request, and what it answers.
class SolveRequest {
public:
    SolveRequest(const delassus_request& raw, const delassus_problem& problem, const double* x, const double* lambda)
        : raw_(&raw), n_(problem.n), m_(problem.m) {
        if (raw.warm_start)
            start = py::make_tuple(array_of(std::vector<double>(x, x + n_)),
                                   array_of(std::vector<double>(lambda, lambda + m_)));
    }
    void end() { raw_ = nullptr; }

    [[nodiscard]] double tolerance() const { return raw().tolerance; }
    [[nodiscard]] std::int64_t max_iterations() const { return raw().max_iterations; }
    [[nodiscard]] double time_limit() const { return raw().time_limit; }
    /// Shows an iterate; whether the solver is to go on.
    bool show(std::int64_t iteration, const Reals& lambda, const std::optional<Reals>& x) {
        const auto lambda_values = sized(lambda, m_, "lam");
        const auto x_values = x ? sized(*x, n_, "x") : std::vector<double>();
        iterations = iteration;
        if (!raw().progress) return true;
        std::int32_t answer = DELASSUS_CONTINUE;
        {
            const py::gil_scoped_release without_gil;
            answer =
                raw().progress(raw().progress_context, iteration, x ? x_values.data() : nullptr, lambda_values.data());
        }
        if (answer == DELASSUS_STOP_TIME) stopped = DELASSUS_TIME_LIMIT;
        if (answer == DELASSUS_STOP_CANCEL) stopped = DELASSUS_CANCELLED;
        return answer == DELASSUS_CONTINUE;
    }
    static std::vector<double> sized(const Reals& values, std::int32_t size, const char* name) {
        auto result = vector_of(values, name);
        if (result.size() != static_cast<std::size_t>(size))
            throw InputError(fmt::format("{} has {} entries; it must have {}", name, result.size(), size));
        return result;
    }

    std::int64_t iterations = 0;
    py::object start = py::none();
    std::optional<delassus_status> stopped;

private:
    [[nodiscard]] const delassus_request& raw() const {
        if (!raw_) throw Error("this request belongs to a solve that has ended");
        return *raw_;
    }
    const delassus_request* raw_;
    std::int32_t n_, m_;
};

inline SparseMatrix copy_of(const delassus_matrix& raw) {
    SparseMatrix matrix;
    matrix.rows = raw.rows;
    matrix.columns = raw.columns;
    matrix.row_start.assign(raw.row_start, raw.row_start + raw.rows + 1);
    matrix.column.assign(raw.column, raw.column + raw.entries);
    matrix.value.assign(raw.value, raw.value + raw.entries);
    return matrix;
}

inline Problem copy_of(const delassus_problem& raw) {
    Problem problem;
    problem.H = copy_of(raw.H);
    problem.D = copy_of(raw.D);
    problem.E = copy_of(raw.E);
    problem.a.assign(raw.a, raw.a + raw.n);
    problem.b.assign(raw.b, raw.b + raw.m);
    problem.law = static_cast<Law>(raw.law);
    for (std::int32_t k = 0; k < raw.cone_count; ++k) {
        const delassus_cone& from = *delassus_cone_at(&raw, k);
        Cone cone = Cone::free(from.rows);
        cone.kind = static_cast<ConeKind>(from.kind);
        if (from.parameter_count > 0) std::copy_n(from.parameters, from.parameter_count, cone.parameters.begin());
        if (from.lo) cone.lo.assign(from.lo, from.lo + from.rows);
        if (from.hi) cone.hi.assign(from.hi, from.hi + from.rows);
        problem.cones.push_back(std::move(cone));
    }
    return problem;
}

/// The problem as a delassus.Problem, which a solver may keep: what it has of it stays whole. It reads the matrices of
/// the Problem that is being solved, and copies those of a scene, which end with a step.
inline py::object problem_of(const delassus_problem& raw) {
    Handover made;
    if (const PreparedProblem* shown = ProblemInUse::now(); shown && &shown->raw() == &raw) {
        made.problem = std::make_unique<SharedProblem>(shown->with_law(shown->problem().law));
    } else {
        made.problem = std::make_unique<SharedProblem>(copy_of(raw));
    }
    return py::module_::import("delassus").attr("_problem_of")(std::move(made));
}

/// An object of the class, behind the border's void*. All of it is used with the GIL.
struct SolverObject {
    py::object object;
    std::string error;

    /// What action returns; an exception becomes the error, and KeyboardInterrupt comes again when Python goes on.
    template <class Action>
    std::int32_t guarded(Action&& action) {
        try {
            return action();
        } catch (py::error_already_set& failure) {
            if (failure.matches(PyExc_KeyboardInterrupt)) {
                PyErr_SetInterrupt();
                return DELASSUS_CANCELLED;
            }
            error = failure.what();
        } catch (const std::exception& failure) {
            error = failure.what();
        }
        return DELASSUS_ERROR;
    }

    std::int32_t call(const char* method, const delassus_problem& raw) {
        return guarded([&] {
            if (py::hasattr(object, method)) object.attr(method)(problem_of(raw));
            return DELASSUS_SOLVED;
        });
    }

    std::int32_t solve(const delassus_problem& raw, const delassus_request& request, double* x, double* lambda,
                       delassus_outcome& outcome) {
        const auto shown = std::make_shared<SolveRequest>(request, raw, x, lambda);
        const std::int32_t status = guarded([&] {
            const py::object answer = object.attr("solve")(problem_of(raw), shown);
            if (!py::isinstance<py::tuple>(answer) || py::len(answer) < 2 || py::len(answer) > 3)
                throw InputError("solve() must return (x, lam) or (x, lam, status)");
            const py::tuple parts(answer);
            const auto new_x = SolveRequest::sized(parts[0].cast<Reals>(), raw.n, "x");
            const auto new_lambda = SolveRequest::sized(parts[1].cast<Reals>(), raw.m, "lam");
            std::copy(new_x.begin(), new_x.end(), x);
            std::copy(new_lambda.begin(), new_lambda.end(), lambda);
            if (parts.size() == 3) return static_cast<int>(status_named(parts[2].cast<std::string>()));
            return static_cast<int>(shown->stopped.value_or(DELASSUS_SOLVED));
        });
        shown->end();
        outcome.status = status;
        outcome.iterations = shown->iterations;
        outcome.analyses = outcome.factorizations = 0;
        outcome.residual = std::numeric_limits<double>::quiet_NaN();
        outcome.message = nullptr;
        return status;
    }

    static delassus_status status_named(const std::string& name) {
        constexpr std::array statuses = {DELASSUS_SOLVED,  DELASSUS_ITERATION_LIMIT, DELASSUS_TIME_LIMIT,
                                         DELASSUS_STALLED, DELASSUS_INFEASIBLE,      DELASSUS_NUMERICAL_FAILURE};
        std::vector<std::string_view> names;
        for (const delassus_status status : statuses) {
            names.push_back(name_of(static_cast<Status>(status)));
            if (names.back() == name) return status;
        }
        throw InputError(
            fmt::format("solve() returned the status \"{}\"; it must be one of {}", name, fmt::join(names, ", ")));
    }
};

inline std::string& creation_error() {
    thread_local std::string text;
    return text;
}

inline std::int32_t create_object(std::size_t number, const delassus_option_value* values, std::int32_t count,
                                  void** solver) {
    const py::gil_scoped_acquire with_gil;
    auto made = std::make_unique<SolverObject>();
    const std::int32_t status = made->guarded([&] {
        py::dict options;
        for (std::int32_t k = 0; k < count; ++k) {
            const delassus_option_value& value = values[k];
            py::object object;
            switch (value.type) {
                case DELASSUS_OPTION_BOOLEAN:
                    object = py::bool_(value.integer != 0);
                    break;
                case DELASSUS_OPTION_INTEGER:
                    object = py::int_(value.integer);
                    break;
                case DELASSUS_OPTION_REAL:
                    object = py::float_(value.real);
                    break;
                default:
                    object = py::str(value.text);
                    break;
            }
            options[value.key] = object;
        }
        made->object = solver_classes()[number]->type(**options);
        return DELASSUS_SOLVED;
    });
    if (status == DELASSUS_SOLVED) {
        *solver = made.release();
    } else {
        creation_error() = made->error;
    }
    return status;
}

/// Makes a plugin of the class. options: (key, default) in order. capabilities: names as delassus.plugins() has them.
inline std::shared_ptr<Plugin> plugin_of(const py::object& type, const std::string& name, const std::string& version,
                                         const std::string& description, const std::string& licence,
                                         const std::vector<std::pair<std::string, py::object>>& options,
                                         const std::vector<std::string>& capabilities) {
    auto& classes = solver_classes();
    if (classes.size() == most_created_plugins)
        throw InputError(fmt::format("{} classes are registered as solvers; there can be no more", classes.size()));
    auto made = std::make_unique<SolverClass>();
    made->type = type;
    made->name = name;
    made->version = version;
    made->description = description;
    made->licence = licence;
    for (const auto& [key, value] : options) {
        OptionInfo row{.key = key};
        if (py::isinstance<py::bool_>(value)) {
            row.type = DELASSUS_OPTION_BOOLEAN;
            row.default_value = value.cast<bool>() ? "true" : "false";
        } else if (py::isinstance<py::int_>(value)) {
            row.type = DELASSUS_OPTION_INTEGER;
            row.default_value = py::str(value);
        } else if (py::isinstance<py::float_>(value)) {
            row.type = DELASSUS_OPTION_REAL;
            row.default_value = py::repr(value).cast<std::string>();
        } else if (py::isinstance<py::str>(value)) {
            row.default_value = value.cast<std::string>();
        } else {
            throw InputError(
                fmt::format("the option {} of {} must have a bool, a number or a text as default", key, name));
        }
        made->rows.push_back(std::move(row));
    }
    constexpr double any = std::numeric_limits<double>::infinity();
    for (const auto& row : made->rows)
        made->options.push_back({row.key.c_str(), row.type, 0, row.default_value.c_str(), -any, any, nullptr, "", ""});
    delassus_plugin_descriptor& descriptor = made->descriptor;
    descriptor.magic = DELASSUS_PLUGIN_MAGIC;
    descriptor.abi_major = DELASSUS_ABI_MAJOR;
    descriptor.abi_minor = DELASSUS_ABI_MINOR;
    descriptor.struct_size = sizeof descriptor;
    descriptor.flags = DELASSUS_FLAG_PEER;  // `auto` leaves it alone
    descriptor.name = made->name.c_str();
    descriptor.version = made->version.c_str();
    descriptor.description = made->description.c_str();
    descriptor.licence = made->licence.c_str();
    descriptor.capabilities = capabilities_of(capabilities);
    descriptor.options = made->options.data();
    descriptor.option_count = static_cast<std::int32_t>(made->options.size());
    descriptor.create = create_slots<&create_object>[classes.size()];
    descriptor.destroy = [](void* solver) {
        const py::gil_scoped_acquire with_gil;
        delete static_cast<SolverObject*>(solver);
    };
    descriptor.analyze = [](void* solver, const delassus_problem* problem) {
        const py::gil_scoped_acquire with_gil;
        return static_cast<SolverObject*>(solver)->call("analyze", *problem);
    };
    descriptor.factorize = [](void* solver, const delassus_problem* problem) {
        const py::gil_scoped_acquire with_gil;
        return static_cast<SolverObject*>(solver)->call("factorize", *problem);
    };
    descriptor.solve = [](void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                          double* lambda, delassus_outcome* outcome) {
        const py::gil_scoped_acquire with_gil;
        return static_cast<SolverObject*>(solver)->solve(*problem, *request, x, lambda, *outcome);
    };
    descriptor.last_error = [](void* solver) {
        return solver ? static_cast<SolverObject*>(solver)->error.c_str() : creation_error().c_str();
    };
    descriptor.accepts = [](void* solver, const delassus_problem* problem, char* reason, std::int32_t capacity) {
        const py::gil_scoped_acquire with_gil;
        auto& self = *static_cast<SolverObject*>(solver);
        std::string refusal;
        const std::int32_t status = self.guarded([&] {
            if (py::hasattr(self.object, "refusal")) {
                const py::object answer = self.object.attr("refusal")(problem_of(*problem));
                if (!answer.is_none()) refusal = answer.cast<std::string>();
            }
            return DELASSUS_SOLVED;
        });
        if (status != DELASSUS_SOLVED) refusal = self.error;
        if (refusal.empty()) return 1;
        const std::size_t length = std::min(refusal.size(), static_cast<std::size_t>(std::max(capacity, 1)) - 1);
        std::memcpy(reason, refusal.data(), length);
        reason[length] = '\0';
        return 0;
    };
    auto plugin = std::const_pointer_cast<Plugin>(Plugin::of(descriptor));  // pybind11 knows no pointers to const
    classes.push_back(made.release());
    return plugin;
}

inline void bind_solver_classes(py::module_& module) {
    using namespace py::literals;

    const py::class_<Plugin, std::shared_ptr<Plugin>> plugin(module, "Plugin",
                                                             "A solver that is a class of Python, ready to register.");
    py::class_<SolveRequest, std::shared_ptr<SolveRequest>>(
        module, "SolveRequest", "What a solve asks of a solver that is a class of Python; used while it lasts.")
        .def_property_readonly("tolerance", &SolveRequest::tolerance,
                               "The natural error to reach (docs/errors.md), > 0.")
        .def_property_readonly("max_iterations", &SolveRequest::max_iterations, "Of the solver's own kind.")
        .def_property_readonly("time_limit", &SolveRequest::time_limit,
                               "s, inf for none; show() enforces it, so this is for planning.")
        .def_readonly("start", &SolveRequest::start, "(x, lam) to start from, or None.")
        .def_readwrite("iterations", &SolveRequest::iterations, "Set it to the iterations done; show() does it too.")
        .def("show", &SolveRequest::show, "iteration"_a, "lam"_a, "x"_a = py::none(),
             "Show an iterate (lam: m; x: n, or None for H⁻¹(a + Dᵀ lam)): it is measured for curves, and Ctrl-C and "
             "time limits come back through it. Returns False where the solver must end and return its best iterate. "
             "The clock of the solve stands still meanwhile.");
    module.def("_plugin_of", &plugin_of);
}

}  // namespace delassus::python
