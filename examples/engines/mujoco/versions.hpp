// SPDX-License-Identifier: BSD-3-Clause
// What differs between versions of MuJoCo. Members and signatures are looked for, not version numbers: a template that
// asks `requires` takes the one that the header has.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <vector>

#if mjVERSION_HEADER < 310
// Exported by the library, missing in the header.
extern "C" MJAPI void mj_implicit(const mjModel* m, mjData* d);
#endif

namespace versions {

/// M, nv × nv by rows. Until 3.9 from data->qM, later from data->M.
template <class Data>
void full_mass(const mjModel* model, const Data* data, mjtNum* dense) {
    if constexpr (requires { mj_fullM(model, data, dense); })
        mj_fullM(model, data, dense);
    else
        mj_fullM(model, dense, data->qM);
}

/// ∂(passive + actuator − bias)/∂qvel, nv × nv by rows, as mj_implicit left it. The pattern is the data's until 3.3,
/// the model's later.
template <class Model, class Data>
void velocity_derivative(const Model* model, const Data* data, std::vector<double>& dense) {
    const auto nv = static_cast<std::size_t>(model->nv);
    const auto fill = [&](const int* count, const int* start, const int* column) {
        dense.assign(nv * nv, 0.0);
        for (std::size_t row = 0; row < nv; ++row)
            for (int k = start[row]; k < start[row] + count[row]; ++k)
                dense[row * nv + static_cast<std::size_t>(column[k])] += data->qDeriv[k];
    };
    if constexpr (requires { data->D_rownnz; })
        fill(data->D_rownnz, data->D_rowadr, data->D_colind);
    else
        fill(model->D_rownnz, model->D_rowadr, model->D_colind);
}

/// What touches in a contact: geoms, and from 3.0 on flexes with their elements and vertices.
using Touching = std::array<int, 8>;
template <class Contact>
Touching touching(const Contact& contact) {
    if constexpr (requires { contact.flex; })
        return {contact.geom[0], contact.geom[1], contact.flex[0], contact.flex[1],
                contact.elem[0], contact.elem[1], contact.vert[0], contact.vert[1]};
    else
        return {contact.geom1, contact.geom2, -1, -1, -1, -1, -1, -1};
}

/// Whether bodies may sleep (from 3.4 on).
template <class Model>
bool sleeps(const Model* model) {
#if mjVERSION_HEADER >= 340
    return (model->opt.enableflags & mjENBL_SLEEP) != 0;
#else
    static_cast<void>(model);
    return false;
#endif
}

inline bool is_implicit(int integrator) {
#if mjVERSION_HEADER >= 233
    if (integrator == mjINT_IMPLICITFAST) return true;
#endif
    return integrator == mjINT_IMPLICIT;
}

/// Whether mj_Euler may damp by more than dof_damping (from 3.5 on: polynomials, actuators).
inline constexpr bool euler_damps_by_more = mjVERSION_HEADER >= 3005000;

/// What an integrator changes, so that it can be tried.
class State {
public:
    template <class Model, class Data>
    void save(const Model* m, const Data* d) {
#if mjVERSION_HEADER >= 237
        values_.resize(static_cast<std::size_t>(mj_stateSize(m, mjSTATE_INTEGRATION)));
        mj_getState(m, d, values_.data(), mjSTATE_INTEGRATION);
#else
        values_.assign(d->qpos, d->qpos + m->nq);
        values_.insert(values_.end(), d->qvel, d->qvel + m->nv);
        values_.insert(values_.end(), d->act, d->act + m->na);
        values_.push_back(d->time);
#endif
    }
    template <class Model, class Data>
    void restore(const Model* m, Data* d) const {
#if mjVERSION_HEADER >= 237
        mj_setState(m, d, values_.data(), mjSTATE_INTEGRATION);
#else
        const double* value = values_.data();
        mju_copy(d->qpos, value, m->nq);
        mju_copy(d->qvel, value += m->nq, m->nv);
        mju_copy(d->act, value += m->nv, m->na);
        d->time = value[m->na];
#endif
    }

private:
    std::vector<double> values_;
};

/// mj_forward without constraint forces: what comes before mj_fwdConstraint, sensors included.
template <class Data>
void before_constraints(const mjModel* model, Data* data) {
    const bool energy = (model->opt.enableflags & mjENBL_ENERGY) != 0;
    mj_fwdPosition(model, data);
    mj_sensorPos(model, data);
    if constexpr (requires { data->flg_energypos; }) {
        if (!data->flg_energypos && !energy) data->energy[0] = data->energy[1] = 0.0;
        if (!data->flg_energypos && energy) mj_energyPos(model, data);
    } else if (energy) {
        mj_energyPos(model, data);
    }
    mj_fwdVelocity(model, data);
    mj_sensorVel(model, data);
    if constexpr (requires { data->flg_energyvel; }) {
        if (!data->flg_energyvel && energy) mj_energyVel(model, data);
    } else if (energy) {
        mj_energyVel(model, data);
    }
    // From 3.4 on actuation that is disabled has no control either.
    if (mjcb_control && (mjVERSION_HEADER < 340 || !(model->opt.disableflags & mjDSBL_ACTUATION)))
        mjcb_control(model, data);
    mj_fwdActuation(model, data);
    mj_fwdAcceleration(model, data);
}

template <class Data>
void acceleration_sensors(const mjModel* model, Data* data) {
    if constexpr (requires { data->flg_rnepost; }) data->flg_rnepost = 0;
    mj_sensorAcc(model, data);
}

/// How many iterations the solver took, where MuJoCo's viewers look for it.
template <class Data>
void set_iterations(Data* data, int iterations) {
    if constexpr (requires { data->solver_niter[0]; })
        data->solver_niter[0] = iterations;
    else if constexpr (requires { data->solver_iter; })
        data->solver_iter = iterations;
}

}  // namespace versions
