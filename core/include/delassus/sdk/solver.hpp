// SPDX-License-Identifier: BSD-3-Clause
// How to write a solver plugin in C++ (docs/writing-a-plugin.md has the walk-through):
//
//     class Mine : public delassus::sdk::Solver {
//     public:
//         explicit Mine(const delassus::sdk::OptionValues& options);
//         void analyze(const ProblemView&) override;
//         void factorize(const ProblemView&) override;
//         Outcome solve(const ProblemView&, const Request&, MutableVectorView x, MutableVectorView lambda) override;
//     };
//     constexpr delassus_option options[] = {…};
//     DELASSUS_SOLVER_PLUGIN(Mine, (delassus::sdk::PluginInfo{.name = "mine", …}), options)
//
// Exceptions may be thrown anywhere: they end at the border as DELASSUS_NUMERICAL_FAILURE (NumericalFailure) or
// DELASSUS_ERROR (anything else), with what() as the sentence.
#pragma once

#include <cstddef>
#include <cstdio>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <string>

#include "delassus/plugin.h"
#include "delassus/sdk/blas_threads.hpp"
#include "delassus/sdk/cost.hpp"
#include "delassus/sdk/h_inverse.hpp"
#include "delassus/sdk/options.hpp"
#include "delassus/sdk/problem_view.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus::sdk {

/// What one solve asks for.
class Request {
public:
    explicit Request(const delassus_request& raw) : raw_(raw) {}

    [[nodiscard]] double tolerance() const { return raw_.tolerance; }  ///< natural error to reach
    [[nodiscard]] std::int64_t max_iterations() const { return raw_.max_iterations; }
    [[nodiscard]] double time_limit() const { return raw_.time_limit; }  ///< seconds; progress() enforces it
    [[nodiscard]] bool warm_start() const { return raw_.warm_start != 0; }
    /// Go on where the last solve stopped (delassus_request.resume).
    [[nodiscard]] bool resume() const {
        return raw_.struct_size >= offsetof(delassus_request, resume) + sizeof raw_.resume && raw_.resume != 0;
    }
    [[nodiscard]] bool has_listener() const { return raw_.progress != nullptr; }

    /// Shows an iterate (x may be null); what it returns must be obeyed.
    [[nodiscard]] delassus_answer progress(std::int64_t iteration, const double* x, const double* lambda) const {
        if (!raw_.progress) return DELASSUS_CONTINUE;
        return static_cast<delassus_answer>(raw_.progress(raw_.progress_context, iteration, x, lambda));
    }

private:
    const delassus_request& raw_;
};

/// How a solve ended.
struct Outcome {
    delassus_status status = DELASSUS_ERROR;
    std::int64_t iterations = 0;
    double residual = std::numeric_limits<double>::quiet_NaN();  ///< the solver's own natural error, if it has one
    std::string message;                                         ///< what a person should know; may be empty
    Cost cost = {};                                              ///< of this process, as far as it is measured
};

/// The status that an answer asks for; the answer must not be DELASSUS_CONTINUE.
constexpr delassus_status status_of(delassus_answer answer) {
    return answer == DELASSUS_STOP_TIME ? DELASSUS_TIME_LIMIT : DELASSUS_CANCELLED;
}

/// The base class of a solver. The host makes one object for each solver, and uses it from one thread at a time.
class Solver {
public:
    virtual ~Solver() = default;

    /// Called for a problem whose needs are all met: an empty string accepts it, anything else is the reason to refuse.
    [[nodiscard]] virtual std::string refusal(const ProblemView&) { return {}; }

    /// The pattern is new.
    virtual void analyze(const ProblemView& problem) = 0;

    /// Values of H, D or E are new.
    virtual void factorize(const ProblemView& problem) = 0;

    /// x: n, lambda: m; on entry the starting point if request.warm_start(), on return the best iterate.
    virtual Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                          MutableVectorView lambda) = 0;

    /// Since construction; the default says that nothing was analysed or factorised.
    [[nodiscard]] virtual std::int64_t analyses() const { return 0; }
    [[nodiscard]] virtual std::int64_t factorizations() const { return 0; }

protected:
    /// The threads that the call at hand may use: the results must be the same to the bit for any size.
    [[nodiscard]] const Team& team() const { return team_; }

private:
    template <class Implementation>
    friend class Border;
    Team team_;
};

/// What the descriptor says of a plugin.
struct PluginInfo {
    const char* name;  ///< lower-case word
    const char* version;
    const char* description;  ///< one line
    const char* licence;      ///< SPDX expression, of the plugin together with what it links
    std::uint64_t capabilities = 0;
    std::uint32_t flags = 0;
};

/// The C side of a solver class; DELASSUS_SOLVER_PLUGIN instantiates it.
template <class Implementation>
class Border {
public:
    template <std::size_t Count>
    static delassus_plugin_descriptor descriptor(const PluginInfo& info, const delassus_option (&table)[Count]) {
        return make(info, table, static_cast<std::int32_t>(Count));
    }
    static delassus_plugin_descriptor descriptor(const PluginInfo& info, std::nullptr_t) {
        return make(info, nullptr, 0);
    }

private:
    struct Instance {
        explicit Instance(const OptionValues& values) : solver(values) {}
        Implementation solver;
        std::string error, message;
    };

    static delassus_plugin_descriptor make(const PluginInfo& info, const delassus_option* table, std::int32_t count) {
        return {DELASSUS_PLUGIN_MAGIC,
                DELASSUS_ABI_MAJOR,
                DELASSUS_ABI_MINOR,
                sizeof(delassus_plugin_descriptor),
                info.flags,
                info.name,
                info.version,
                info.description,
                info.licence,
                info.capabilities,
                table,
                count,
                0,
                &create,
                &destroy,
                &analyze,
                &factorize,
                &solve,
                &last_error,
                &accepts,
                &use_team,
                analyze_partitioned(),
                factorize_partitioned(),
                solve_partitioned(),
                DELASSUS_BUILD,
                0};
    }

    // ---- Partitioned problems: a class derived from PartitionedSolver (sdk/partitioned_solver.hpp) takes them ----

    /// As the base, whose overloads the class's own hide.
    static auto& partitioned(Instance& instance) {
        return static_cast<typename Implementation::LocalBase&>(instance.solver);
    }

    using LocalCall = std::int32_t (*)(void*, const delassus_local_problem*);
    using LocalSolve = std::int32_t (*)(void*, const delassus_local_problem*, const delassus_request*, double*, double*,
                                        delassus_outcome*);

    static constexpr LocalCall analyze_partitioned() {
        if constexpr (requires { typename Implementation::LocalView; })
            return [](void* solver, const delassus_local_problem* problem) -> std::int32_t {
                auto& instance = *static_cast<Instance*>(solver);
                return guarded(instance.error, [&] {
                    partitioned(instance).analyze(typename Implementation::LocalView(*problem));
                    return DELASSUS_SOLVED;
                });
            };
        return nullptr;
    }

    static constexpr LocalCall factorize_partitioned() {
        if constexpr (requires { typename Implementation::LocalView; })
            return [](void* solver, const delassus_local_problem* problem) -> std::int32_t {
                auto& instance = *static_cast<Instance*>(solver);
                return guarded(instance.error, [&] {
                    partitioned(instance).factorize(typename Implementation::LocalView(*problem));
                    return DELASSUS_SOLVED;
                });
            };
        return nullptr;
    }

    static constexpr LocalSolve solve_partitioned() {
        if constexpr (requires { typename Implementation::LocalView; })
            return [](void* solver, const delassus_local_problem* problem, const delassus_request* request, double* x,
                      double* lambda, delassus_outcome* outcome) -> std::int32_t {
                auto& instance = *static_cast<Instance*>(solver);
                return solve(instance, *outcome, [&] {
                    return partitioned(instance).solve(typename Implementation::LocalView(*problem), Request(*request),
                                                       MutableVectorView(x, problem->n),
                                                       MutableVectorView(lambda, problem->m));
                });
            };
        return nullptr;
    }

    static std::string& creation_error() {
        thread_local std::string text;
        return text;
    }

    /// Runs body and turns exceptions into a status and a sentence.
    template <class Body>
    static std::int32_t guarded(std::string& error, Body&& body) noexcept {
        try {
            return body();
        } catch (const NumericalFailure& failure) {
            keep(error, failure.what());
            return DELASSUS_NUMERICAL_FAILURE;
        } catch (const std::bad_alloc&) {
            keep(error, "out of memory");
        } catch (const std::exception& failure) {
            keep(error, failure.what());
        } catch (...) {
            keep(error, "an exception that is not a std::exception");
        }
        return DELASSUS_ERROR;
    }

    static void keep(std::string& error, const char* sentence) noexcept {
        try {
            error = sentence;
        } catch (const std::bad_alloc&) {
            error = "out of memory";  // short enough to need none
        }
    }

    static std::int32_t create(const delassus_option_value* values, std::int32_t count, void** solver) {
        *solver = nullptr;
        return guarded(creation_error(), [&] {
            *solver = new Instance(OptionValues({values, static_cast<std::size_t>(count)}));
            return DELASSUS_SOLVED;
        });
    }

    static void destroy(void* solver) { delete static_cast<Instance*>(solver); }

    static std::int32_t accepts(void* solver, const delassus_problem* problem, char* reason, std::int32_t capacity) {
        auto& instance = *static_cast<Instance*>(solver);
        std::string refusal;
        const auto status = guarded(instance.error, [&] {
            refusal = instance.solver.refusal(ProblemView(*problem));
            return DELASSUS_SOLVED;
        });
        if (status != DELASSUS_SOLVED) refusal = instance.error;
        if (refusal.empty()) return 1;
        std::snprintf(reason, static_cast<std::size_t>(capacity), "%s", refusal.c_str());
        return 0;
    }

    static void use_team(void* solver, const delassus_team* team) {
        Team& own = static_cast<Solver&>(static_cast<Instance*>(solver)->solver).team_;
        own = Team(team);
        BlasThreads::use(own);
    }

    static std::int32_t analyze(void* solver, const delassus_problem* problem) {
        auto& instance = *static_cast<Instance*>(solver);
        return guarded(instance.error, [&] {
            static_cast<Solver&>(instance.solver).analyze(ProblemView(*problem));
            return DELASSUS_SOLVED;
        });
    }

    static std::int32_t factorize(void* solver, const delassus_problem* problem) {
        auto& instance = *static_cast<Instance*>(solver);
        return guarded(instance.error, [&] {
            static_cast<Solver&>(instance.solver).factorize(ProblemView(*problem));
            return DELASSUS_SOLVED;
        });
    }

    static std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                              double* lambda, delassus_outcome* outcome) {
        auto& instance = *static_cast<Instance*>(solver);
        return solve(instance, *outcome, [&] {
            return static_cast<Solver&>(instance.solver)
                .solve(ProblemView(*problem), Request(*request), MutableVectorView(x, problem->n),
                       MutableVectorView(lambda, problem->m));
        });
    }

    /// body returns the Outcome of a solve.
    template <class Body>
    static std::int32_t solve(Instance& instance, delassus_outcome& outcome, Body&& body) {
        instance.message.clear();
        outcome.iterations = 0;
        outcome.residual = std::numeric_limits<double>::quiet_NaN();
        outcome.message = nullptr;
        outcome.status = guarded(instance.error, [&]() -> std::int32_t {
            Outcome result = body();
            outcome.iterations = result.iterations;
            outcome.residual = result.residual;
            result.cost.write(outcome);
            instance.message = std::move(result.message);
            if (!instance.message.empty()) outcome.message = instance.message.c_str();
            if (result.status == DELASSUS_ERROR || result.status == DELASSUS_NUMERICAL_FAILURE)
                instance.error = instance.message.empty() ? "the solver gave no reason" : instance.message;
            return result.status;
        });
        outcome.analyses = instance.solver.analyses();
        outcome.factorizations = instance.solver.factorizations();
        return outcome.status;
    }

    static const char* last_error(void* solver) {
        return solver ? static_cast<Instance*>(solver)->error.c_str() : creation_error().c_str();
    }
};

}  // namespace delassus::sdk

/// Exports Class as the plugin of this shared library. info: a delassus::sdk::PluginInfo, in parentheses; options: a
/// static array of delassus_option, or nullptr.
#define DELASSUS_SOLVER_PLUGIN(Class, info, options)                                        \
    extern "C" DELASSUS_PLUGIN_EXPORT const delassus_plugin_descriptor* delassus_plugin() { \
        static const delassus_plugin_descriptor descriptor =                                \
            ::delassus::sdk::Border<Class>::descriptor(info, options);                      \
        return &descriptor;                                                                 \
    }
