// SPDX-License-Identifier: BSD-3-Clause
// Runs a model as it is for some seconds, with MuJoCo's own solver and with Delassus, and says what a step takes, how
// deep things overlap, and what failed. Controls are 0, or those of the first keyframe.
//     run MODEL [SECONDS [CONDIM [SOLVER]]]
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <memory>
#include <string>

#include "delassus_mujoco.h"

namespace {

struct Delete {
    void operator()(mjModel* m) const { mj_deleteModel(m); }
    void operator()(mjData* d) const { mj_deleteData(d); }
    void operator()(delassus_mujoco* contact) const { delassus_mujoco_free(contact); }
};

/// step(m, d) is false where it failed. False if it failed, or if the end is not finite.
bool run(const mjModel* m, double seconds, const std::string& name,
         const std::function<bool(const mjModel*, mjData*)>& step) {
    const std::unique_ptr<mjData, Delete> d(mj_makeData(m));
    if (m->nkey > 0) mj_resetDataKeyframe(m, d.get(), 0);
    double deepest = 0.0;
    long long contacts = 0, steps = 0, failures = 0;
    const std::clock_t begin = std::clock();
    while (d->time < seconds - 0.5 * m->opt.timestep) {
        const double before = d->time;
        if (!step(m, d.get())) {
            ++failures;
            mj_step(m, d.get());
        }
        if (d->time <= before) {
            std::printf("%-28s MuJoCo reset the state at %g s\n", name.c_str(), before);
            return false;
        }
        ++steps;
        contacts += d->ncon;
        for (int k = 0; k < d->ncon; ++k)
            if (d->contact[k].efc_address >= 0) deepest = std::max(deepest, -d->contact[k].dist);
    }
    const double time = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    double kinetic = 0.0;
    for (int k = 0; k < m->nv; ++k) kinetic = std::max(kinetic, std::abs(d->qvel[k]));
    std::printf("%-28s %8lld %9.1f %10.1f %10.4f %12.2e %12.2e %9lld\n", name.c_str(), steps,
                static_cast<double>(contacts) / static_cast<double>(steps), 1e6 * time / static_cast<double>(steps),
                time / seconds, deepest, kinetic, failures);
    return failures == 0 && std::isfinite(kinetic);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: run MODEL [SECONDS [CONDIM [SOLVER]]]\n");
        return 2;
    }
    const double seconds = argc > 2 ? std::atof(argv[2]) : 10.0;
    const int condim = argc > 3 ? std::atoi(argv[3]) : 0;
    const std::string solver = argc > 4 ? argv[4] : "";
    char error[500] = "";
    const std::unique_ptr<mjModel, Delete> model(mj_loadXML(argv[1], nullptr, error, sizeof error));
    if (!model) {
        std::fprintf(stderr, "%s\n", error);
        return 2;
    }
    if (condim > 0) {
        std::fill_n(model->geom_condim, model->ngeom, condim);
        std::fill_n(model->pair_dim, model->npair, condim);
    }
    std::printf("%-28s %8s %9s %10s %10s %12s %12s %9s\n", "solver", "steps", "contacts", "step, us", "s per s",
                "overlap, m", "end speed", "failures");
    bool fine = run(model.get(), seconds, "MuJoCo", [](const mjModel* m, mjData* d) {
        mj_step(m, d);
        return true;
    });
    for (const char* contacts : {"hard", "mujoco"}) {
        delassus_mujoco_options options{};
        options.contacts = contacts;
        if (!solver.empty()) options.solver = solver.c_str();
        const std::unique_ptr<delassus_mujoco, Delete> contact(delassus_mujoco_create(&options, error, sizeof error));
        if (!contact) {
            std::fprintf(stderr, "%s\n", error);
            return 2;
        }
        int said = 0;
        fine = run(model.get(), seconds, std::string("Delassus, ") + contacts,
                   [&](const mjModel* m, mjData* d) {
                       if (delassus_step(m, d, contact.get()) == 0) return true;
                       if (++said <= 3)
                           std::fprintf(stderr, "at %g s: %s\n", d->time, delassus_mujoco_message(contact.get()));
                       return false;
                   }) &&
               fine;
    }
    return fine ? 0 : 1;
}
