// SPDX-License-Identifier: BSD-3-Clause
#include "delassus_mujoco.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact_memory.hpp"
#include "contact_problem.hpp"
#include "delassus/error.hpp"
#include "delassus/errors.hpp"
#include "delassus/needs.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"
#include "versions.hpp"

struct delassus_mujoco {
public:
    explicit delassus_mujoco(const delassus_mujoco_options& options)
        : compliance_(compliance_of(options.contacts ? options.contacts : "hard")),
          law_(delassus::law_of(options.law ? options.law : "coulomb")),
          solver_(make_solver(registry_, delassus::parse_solver(options.solver ? options.solver : "ssn"))),
          problem_(compliance_) {
        if (!options.solver) second_.emplace(make_solver(registry_, delassus::parse_solver("auto")));
        settings_.tolerance = options.tolerance > 0.0 ? options.tolerance : 1e-9;
        settings_.loosest = std::max(options.loosest > 0.0 ? options.loosest : 1e-6, settings_.tolerance);
        settings_.max_iterations = 10000;
        settings_.warm_start = true;
        settings_.origin = delassus::Origin::Step;
    }

    void forward(const mjModel* m, mjData* d) {
        refuse(m);
        versions::before_constraints(m, d);
        constrain(m, d);
        versions::acceleration_sensors(m, d);
    }

    void step(const mjModel* m, mjData* d) {
        refuse(m);
        mj_checkPos(m, d);
        mj_checkVel(m, d);
        forward(m, d);
        mj_checkAcc(m, d);
        integrate(m, d);
    }

    void forget() { memory_.forget(); }

    std::string message;
    delassus_mujoco_report report{};

private:
    static Compliance compliance_of(const std::string& name) {
        if (name == "hard") return Compliance::Hard;
        if (name == "mujoco") return Compliance::Mujoco;
        throw delassus::InputError("Contacts are \"hard\" or \"mujoco\", not \"" + name + "\".");
    }

    static void refuse(const mjModel* m) {
        if (m->opt.integrator != mjINT_EULER && !versions::is_implicit(m->opt.integrator))
            throw delassus::Unsupported(
                "delassus_step takes the integrators Euler, implicit and implicitfast; the model has RK4, whose stages "
                "are no steps.");
        if (versions::sleeps(m))
            throw delassus::Unsupported("delassus_step knows of no sleeping bodies; switch the flag `sleep` off.");
    }

    static void integrate(const mjModel* m, mjData* d) {
        if (versions::is_implicit(m->opt.integrator))
            mj_implicit(m, d);
        else
            mj_Euler(m, d);
    }

    /// The velocities that MuJoCo's integrator makes of the forces in data, which stays as it is but for qDeriv.
    void try_integrator(const mjModel* m, mjData* d, std::vector<double>& velocity) {
        state_.save(m, d);
        integrate(m, d);
        velocity.assign(d->qvel, d->qvel + m->nv);
        state_.restore(m, d);
    }

    /// In place of mj_fwdConstraint.
    void constrain(const mjModel* m, mjData* d) {
        const auto begin = std::chrono::steady_clock::now();
        report = {};
        mju_zero(d->qfrc_constraint, m->nv);
        if (d->nefc > 0) solve(m, d);
        if (report.rows > 0) {
            mj_mulJacTVec(m, d, d->qfrc_constraint, d->efc_force);
            mju_add(force_.data(), d->qfrc_smooth, d->qfrc_constraint, m->nv);
            mj_solveM(m, d, d->qacc, force_.data(), 1);
        } else {
            mju_copy(d->qacc, d->qacc_smooth, m->nv);
            memory_.forget();
        }
        mju_copy(d->qacc_warmstart, d->qacc, m->nv);
        versions::set_iterations(d, static_cast<int>(report.iterations));
        report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    }

    /// MuJoCo's integrator is the truth about v⁺. Its matrix may be unsymmetric, or damped by more than dof_damping;
    /// the problem has the symmetric part of what is known. What is missing in v⁺ = v_f + H⁻¹Jᵀλ is added to v_f, until
    /// both agree.
    void solve(const mjModel* m, mjData* d) {
        mj_mulJacVec(m, d, d->efc_b, d->qacc_smooth);
        mju_subFrom(d->efc_b, d->efc_aref, d->nefc);
        force_.resize(static_cast<std::size_t>(m->nv));
        const bool hard = compliance_ == Compliance::Hard;
        const bool implicit = versions::is_implicit(m->opt.integrator);
        if (hard && implicit) {
            try_integrator(m, d, velocity_);
            versions::velocity_derivative(m, d, derivative_);
        }
        problem_.read(m, d, hard && implicit ? derivative_.data() : nullptr);
        report.rows = static_cast<int>(problem_.rows());
        for (const ConstraintBlock& block : problem_.blocks())
            report.contacts += block.kind == ConstraintBlock::Contact || block.kind == ConstraintBlock::Frictionless;
        report.remembered = memory_.recall(d, problem_, solution_.lambda);
        if (hard && implicit) problem_.x_free() = velocity_;
        double wanted = 0.0;
        if (hard) {
            change_.assign(d->qvel, d->qvel + m->nv);
            mju_sub(change_.data(), problem_.x_free().data(), change_.data(), m->nv);
            wanted = settings_.tolerance * problem_.H().norm(change_.data());
        }
        for (int round = 0;; ++round) {
            solve_or_leave_overlaps(d);
            problem_.write_forces(m, d, solution_.lambda);
            if (!hard || (!implicit && !versions::euler_damps_by_more)) break;
            mj_mulJacTVec(m, d, d->qfrc_constraint, d->efc_force);
            try_integrator(m, d, velocity_);
            problem_.unknowns(solution_.lambda, unknowns_);
            mju_sub(change_.data(), velocity_.data(), unknowns_.data(), m->nv);
            const double rest = problem_.H().norm(change_.data());
            if (rest <= std::max(wanted, 1e-15 * problem_.H().norm(velocity_.data()))) break;
            if (round == most_rounds)
                throw delassus::Unsupported(
                    "The velocities of MuJoCo's integrator could not be met; take a shorter step, or Euler.");
            mju_addTo(problem_.x_free().data(), change_.data(), m->nv);
        }
        memory_.store(d, problem_, solution_.lambda);
    }

    /// Bodies may overlap in a way that no motion undoes. Then no forces are the answer, or forces without bounds.
    void solve_or_leave_overlaps(mjData* d) {
        const std::vector<double> lambda = solution_.lambda;
        try {
            solve_cones(d);
        } catch (const delassus::Error&) {
            if (!problem_.leave_overlaps()) throw;
            solution_.lambda = lambda;
            solve_cones(d);
        }
    }

    /// Solves until the forces are the answer with the bounds of torsional and rolling friction that follow from them.
    ///
    /// Where nothing has changed, the forces of the step before are the answer already, and no solver is asked: their
    /// error is half way, by orders of magnitude, from the tolerance to what rounding leaves. But forces that stopped
    /// a body are not those that hold it: from the first step that starts so, a solve more is needed. And a solve has
    /// to gain a digit on its start, or what is left of a motion would never come to rest.
    ///
    /// Bounds that follow the normal forces may go round in a circle where several contacts share a load: from the
    /// fifth round on they follow half the way. After most_rounds the best round counts. All but these bounds is then
    /// as exact as ever; the report has the error that they leave.
    void solve_cones(mjData* d) {
        double best = std::numeric_limits<double>::infinity();
        for (int round = 0;; ++round) {
            before_ = bounding_;
            bounding_ = solution_.lambda;
            delassus::Errors start = pose(d);
            report.natural_error = start.natural;
            if (start.natural == 0.0) return;
            if (round == 0) {
                const bool still = start.natural <= std::sqrt(start.rounding * settings_.tolerance);
                if (still && was_still_) return;
                was_still_ = still;
            } else if (start.natural <= settings_.tolerance) {
                return;
            } else if (start.natural < best) {
                best = start.natural;
                best_ = solution_.lambda;
            }
            if (round == most_rounds) {
                if (!(best <= std::sqrt(settings_.loosest)))
                    throw delassus::Error("The bounds of torsional and rolling friction did not settle.");
                report.natural_error = best;
                solution_.lambda = best_;
                return;
            }
            if (round >= 4) {
                for (std::size_t k = 0; k < bounding_.size(); ++k) bounding_[k] = 0.5 * (before_[k] + bounding_[k]);
                start = pose(d);
                if (start.natural == 0.0) continue;
            }
            solve_prepared(start);
            if (!problem_.has_bounds()) return;
        }
    }
    /// The problem with bounds of the forces in bounding_; the error of the forces in solution_.
    delassus::Errors pose(const mjData* d) {
        delassus::Problem problem = problem_.problem(d, bounding_, law_);
        if (prepared_)
            prepared_->renew(std::move(problem));
        else
            prepared_.emplace(std::move(problem));
        return prepared_->measure({}, solution_.lambda);
    }
    void solve_prepared(const delassus::Errors& start) {
        delassus::SolveSettings settings = settings_;
        settings.tolerance = std::min(settings.tolerance, std::max(0.1 * start.natural, start.rounding));
        const std::vector<double> lambda = solution_.lambda;
        delassus::SolveReport solved = solver_.solve(*prepared_, solution_, settings);
        if (!(solved.error.natural <= settings_.loosest) && second_) {
            report.iterations += solved.iterations;
            solution_.lambda = lambda;
            solved = second_->solve(*prepared_, solution_, settings);
        }
        ++report.solves;
        report.iterations += solved.iterations;
        report.natural_error = solved.error.natural;
        if (solved.error.natural <= settings_.loosest) return;
        char error[40];
        std::snprintf(error, sizeof error, "%.1e", solved.error.natural);
        throw delassus::Error("The solver \"" + solved.solver + "\" ended with " + std::string(name_of(solved.status)) +
                              " at a natural error of " + error + "; another solver or a looser limit may do.");
    }

    static constexpr int most_rounds = 20;

    bool was_still_ = false;  ///< this step, or the one before, started from its answer
    delassus::Registry registry_;
    Compliance compliance_;
    delassus::Law law_;
    delassus::Solver solver_;
    std::optional<delassus::Solver> second_;  ///< for what the first one leaves
    delassus::SolveSettings settings_;
    ContactProblem problem_;
    ContactMemory memory_;
    versions::State state_;
    std::optional<delassus::PreparedProblem> prepared_;
    delassus::Solution solution_;
    std::vector<double> force_, velocity_, derivative_, change_, unknowns_, bounding_, before_, best_;
};

namespace {

template <class Do>
int guarded(delassus_mujoco* contact, const Do& act) {
    try {
        contact->message.clear();
        act();
        return 0;
    } catch (const std::exception& error) {
        contact->message = error.what();
    } catch (...) {
        contact->message = "Something that is no std::exception was thrown.";
    }
    return -1;
}

}  // namespace

extern "C" {

delassus_mujoco* delassus_mujoco_create(const delassus_mujoco_options* options, char* message, size_t size) {
    try {
        return std::make_unique<delassus_mujoco>(options ? *options : delassus_mujoco_options{}).release();
    } catch (const std::exception& error) {
        if (message && size > 0) std::snprintf(message, size, "%s", error.what());
        return nullptr;
    }
}
void delassus_mujoco_free(delassus_mujoco* contact) {
    delete contact;
}
int delassus_step(const mjModel* model, mjData* data, delassus_mujoco* contact) {
    return guarded(contact, [&] { contact->step(model, data); });
}
int delassus_forward(const mjModel* model, mjData* data, delassus_mujoco* contact) {
    return guarded(contact, [&] { contact->forward(model, data); });
}
const char* delassus_mujoco_message(const delassus_mujoco* contact) {
    return contact->message.c_str();
}
delassus_mujoco_report delassus_mujoco_last(const delassus_mujoco* contact) {
    return contact->report;
}
void delassus_mujoco_forget(delassus_mujoco* contact) {
    contact->forget();
}

}  // extern "C"
