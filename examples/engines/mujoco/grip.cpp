// SPDX-License-Identifier: BSD-3-Clause
// How fast a held object creeps through a grip, and how long a step takes: MuJoCo's own solvers, and Delassus.
//     grip MODEL [STEPS]
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "delassus_mujoco.h"

namespace {

struct Delete {
    void operator()(mjModel* m) const { mj_deleteModel(m); }
    void operator()(mjData* d) const { mj_deleteData(d); }
    void operator()(delassus_mujoco* contact) const { delassus_mujoco_free(contact); }
};

struct Result {
    double creep = 0.0;         ///< m/s, downwards, over the second half
    double microseconds = 0.0;  ///< CPU time of a step, the median of twenty parts of the run
    bool failed = false;
};

/// step(m, d) is false where it failed; its sentence was printed.
Result run(const mjModel* m, int steps, const std::function<bool(const mjModel*, mjData*)>& step) {
    const std::unique_ptr<mjData, Delete> d(mj_makeData(m));
    mj_resetDataKeyframe(m, d.get(), 0);
    const int height = m->jnt_qposadr[mj_name2id(m, mjOBJ_JOINT, "rod")] + 2;
    Result result;
    double from = 0.0;
    std::vector<double> times;
    const int part = std::max(1, steps / 20);
    for (int n = 0; n < 2 * part * 10; n += part) {
        if (n == 10 * part) from = d->qpos[height];
        const std::clock_t begin = std::clock();
        for (int k = 0; k < part; ++k)
            if (!step(m, d.get())) return {NAN, NAN, true};
        times.push_back(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / part);
    }
    result.creep = (from - d->qpos[height]) / (10 * part * m->opt.timestep);
    std::nth_element(times.begin(), times.begin() + 10, times.end());
    result.microseconds = 1e6 * times[10];
    return result;
}

void print(const std::string& name, const Result& result) {
    std::printf("%-44s %12.3e %10.1f\n", name.c_str(), result.creep, result.microseconds);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: grip MODEL [STEPS]\n");
        return 2;
    }
    const int steps = argc > 2 ? std::max(20, std::atoi(argv[2])) : 2000;
    char error[500] = "";
    const std::unique_ptr<mjModel, Delete> model(mj_loadXML(argv[1], nullptr, error, sizeof error));
    if (!model) {
        std::fprintf(stderr, "%s\n", error);
        return 2;
    }
    mjModel* m = model.get();
    std::printf("%-44s %12s %10s\n", "solver", "creep, m/s", "step, us");
    const auto mujoco = [](const mjModel* of, mjData* d) {
        mj_step(of, d);
        return true;
    };
    double newton_noslip = 0.0;
    const int cone = m->opt.cone;
    for (const auto& [kind, name] :
         {std::pair{mjCONE_PYRAMIDAL, "pyramidal"}, std::pair{mjCONE_ELLIPTIC, "elliptic"}}) {
        for (const auto& [solver, label] :
             {std::pair{mjSOL_NEWTON, "Newton"}, std::pair{mjSOL_CG, "CG"}, std::pair{mjSOL_PGS, "PGS"}}) {
            for (const int noslip : {0, 10}) {
                m->opt.cone = kind;
                m->opt.solver = solver;
                m->opt.noslip_iterations = noslip;
                const Result result = run(m, steps, mujoco);
                print(std::string("MuJoCo, ") + name + ", " + label + (noslip ? ", noslip 10" : ""), result);
                if (kind == cone && solver == mjSOL_NEWTON && noslip) newton_noslip = result.microseconds;
            }
        }
    }
    m->opt.solver = mjSOL_NEWTON;
    m->opt.noslip_iterations = 0;
    bool shown = true;
    for (const auto& [kind, name] :
         {std::pair{mjCONE_PYRAMIDAL, "pyramidal"}, std::pair{mjCONE_ELLIPTIC, "elliptic"}}) {
        m->opt.cone = kind;
        for (const char* contacts : {"hard", "mujoco"}) {
            for (const char* solver : {"ssn", "pgs", "auto"}) {
                delassus_mujoco_options options{};
                options.solver = solver;
                options.contacts = contacts;
                const std::unique_ptr<delassus_mujoco, Delete> contact(
                    delassus_mujoco_create(&options, error, sizeof error));
                if (!contact) {
                    std::fprintf(stderr, "%s\n", error);
                    return 2;
                }
                const Result result = run(m, steps, [&](const mjModel* of, mjData* d) {
                    if (delassus_step(of, d, contact.get()) == 0) return true;
                    std::fprintf(stderr, "at %g s: %s\n", d->time, delassus_mujoco_message(contact.get()));
                    return false;
                });
                print(std::string("Delassus, ") + name + ", " + contacts + ", " + solver, result);
                const delassus_mujoco_report report = delassus_mujoco_last(contact.get());
                if (std::getenv("GRIP_DETAILS"))
                    std::printf(
                        "    rows %d, contacts %d, solves %d, remembered %d, iterations %lld, error %.1e, %.1f us\n",
                        report.rows, report.contacts, report.solves, report.remembered, report.iterations,
                        report.natural_error, 1e6 * report.seconds);
                if (kind == cone && std::string(contacts) == "hard" && std::string(solver) == "ssn")
                    shown = std::abs(result.creep) < 1e-9 && result.microseconds < 2.0 * newton_noslip;
            }
        }
    }
    return shown ? 0 : 1;
}
