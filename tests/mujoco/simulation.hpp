// SPDX-License-Identifier: BSD-3-Clause
// A model of MuJoCo from text, its data, and the contact forces of Delassus.
#pragma once

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include "delassus_mujoco.h"
#include "support/run_command.hpp"

class Simulation {
public:
    /// mjcf: what is within <mujoco>, or the path of a file. Throws std::runtime_error with MuJoCo's or our sentence.
    explicit Simulation(const std::string& mjcf, const delassus_mujoco_options& options = {}) {
        char error[1000] = "";
        std::string path = mjcf;
        const delassus::tests::ScratchFolder folder;
        if (mjcf.find('<') != std::string::npos) {
            path = (folder.path() / "model.xml").string();
            std::ofstream(path) << "<mujoco>" << mjcf << "</mujoco>";
        }
        model_.reset(mj_loadXML(path.c_str(), nullptr, error, sizeof error));
        if (!model_) throw std::runtime_error(error);
        data_.reset(mj_makeData(model_.get()));
        contact_.reset(delassus_mujoco_create(&options, error, sizeof error));
        if (!contact_) throw std::runtime_error(error);
    }

    mjModel* m() { return model_.get(); }
    mjData* d() { return data_.get(); }
    void step(int count = 1) {
        for (int n = 0; n < count; ++n)
            ASSERT_EQ(delassus_step(m(), d(), contact_.get()), 0) << "at " << d()->time << " s: " << message();
    }
    int try_step() { return delassus_step(m(), d(), contact_.get()); }
    int forward() { return delassus_forward(m(), d(), contact_.get()); }
    std::string message() const { return delassus_mujoco_message(contact_.get()); }
    delassus_mujoco_report last() const { return delassus_mujoco_last(contact_.get()); }

    /// The sum of contact forces along an axis of space that act on the second geoms.
    double contact_force(int axis) {
        double sum = 0.0;
        for (int k = 0; k < d()->ncon; ++k) {
            mjtNum force[6], in_space[3];
            mj_contactForce(m(), d(), k, force);
            mju_mulMatTVec(in_space, d()->contact[k].frame, force, 3, 3);
            sum += in_space[axis];
        }
        return sum;
    }

private:
    struct Delete {
        void operator()(mjModel* m) const { mj_deleteModel(m); }
        void operator()(mjData* d) const { mj_deleteData(d); }
        void operator()(delassus_mujoco* contact) const { delassus_mujoco_free(contact); }
    };
    std::unique_ptr<mjModel, Delete> model_;
    std::unique_ptr<mjData, Delete> data_;
    std::unique_ptr<delassus_mujoco, Delete> contact_;
};
