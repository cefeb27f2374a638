// SPDX-License-Identifier: BSD-3-Clause
// A model as a scene, and what libmujoco makes of the same model, or of one that was written by hand for the purpose.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "delassus/joint_coordinates.hpp"
#include "delassus/model_import.hpp"
#include "delassus/scene.hpp"
#include "support/dense.hpp"
#include "support/places.hpp"
#include "support/run_command.hpp"

#ifdef DELASSUS_HAS_MUJOCO
#include <mujoco/mujoco.h>
#endif

namespace delassus::tests {

inline std::filesystem::path model_file(const std::string& name) {
    return std::filesystem::path(tests::places::source) / "tests" / "import" / "models" / name;
}

/// The items of a list, by what they are.
inline std::vector<std::string> items(const std::vector<NotCarriedOver>& all) {
    std::vector<std::string> result;
    for (const auto& one : all) result.push_back(one.what);
    return result;
}

/// An imported model whose scene lies in a folder of its own with its files.
struct Imported {
    ScratchFolder folder;
    ImportedScene text;
    Scene scene;

    explicit Imported(const std::filesystem::path& model, const ImportSettings& settings = {}) {
        const auto file = folder / "scene.yaml";
        text = import_model(model, file, settings);
        for (const auto& one : text.files) {
            std::filesystem::create_directories((folder.path() / one.path).parent_path());
            std::ofstream(folder.path() / one.path) << one.content;
        }
        std::ofstream(file) << text.yaml;
        scene = read_scene(file);
        system().assemble();
    }
    [[nodiscard]] MultibodySystem& system() { return *scene.systems.front().system; }
};

#ifdef DELASSUS_HAS_MUJOCO

using MjModel = std::unique_ptr<mjModel, void (*)(mjModel*)>;
using MjData = std::unique_ptr<mjData, void (*)(mjData*)>;

inline MjModel mujoco_model(const std::filesystem::path& file) {
    mju_user_warning = [](const char*) {};  // or they go to a file
    char error[1000] = "";
    MjModel model(mj_loadXML(file.c_str(), nullptr, error, sizeof error), mj_deleteModel);
    EXPECT_TRUE(model) << error;
    return model;
}

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// A scene beside libmujoco, with the coordinates of both.
class Beside {
public:
    /// reference: coordinates of MuJoCo's joints where those of the scene are 0, for joints where that is not qpos0.
    Beside(MultibodySystem& system, const mjModel& m, const std::map<std::string, double>& reference = {},
           int keyframe = -1, double within = 1e-9)
        : tolerance(within), system_(system), m_(m), d_(mj_makeData(&m), mj_deleteData), joints_(system) {
        for (int j = 0; j < m.njnt; ++j) {
            const auto given = reference.find(mj_id2name(&m, mjOBJ_JOINT, j) ? mj_id2name(&m, mjOBJ_JOINT, j) : "");
            reference_.push_back(given == reference.end() ? m.qpos0[m.jnt_qposadr[j]] : given->second);
        }
        mju_copy(d_->qpos, m.qpos0, m.nq);
        for (int j = 0; j < m.njnt; ++j) {
            const int at = m.jnt_qposadr[j];
            if (is_scalar(j)) {
                d_->qpos[at] = reference_[static_cast<std::size_t>(j)];
            } else if (keyframe >= 0) {
                mju_copy(d_->qpos + at, m.key_qpos + keyframe * m.nq + at, m.jnt_type[j] == mjJNT_FREE ? 7 : 4);
            }
        }
        if (keyframe >= 0) mju_copy(d_->ctrl, m.key_ctrl + keyframe * m.nu, m.nu);
        mj_fwdPosition(&m_, d_.get());
        for (BodyIndex body = 0; body < system.body_count(); ++body) {
            const BodyParameters& own = system.body(body);
            const int there = own.fixed || own.massless ? -1 : mj_name2id(&m, mjOBJ_BODY, own.name.c_str());
            body_.push_back(there);
            centre_.emplace_back(Vector3d::Zero());
            if (there < 0) {
                EXPECT_TRUE(own.fixed || own.massless) << own.name;
                continue;
            }
            const Quaterniond turn = orientation(there);
            centre_.back() = turn.conjugate() * (Vector3d(own.pose.position.data()) - Vector3d(d_->xpos + 3 * there));
            compare_pose(own.name, own.pose, there, body);
            if (own.mass == m.body_mass[there]) {
                EXPECT_LE((centre_.back() - Vector3d(m.body_ipos + 3 * there)).norm(), tolerance) << own.name;
            }
        }
    }

    /// Coordinates and velocities at random, and of the scene the same.
    State draw(std::mt19937& random) {
        std::uniform_real_distribution<double> by(-1.0, 1.0);
        for (int j = 0; j < m_.njnt; ++j) {
            const int at = m_.jnt_qposadr[j];
            if (is_scalar(j)) {
                d_->qpos[at] =
                    reference_[static_cast<std::size_t>(j)] + (m_.jnt_type[j] == mjJNT_HINGE ? 1.2 : 0.3) * by(random);
                continue;
            }
            const bool free = m_.jnt_type[j] == mjJNT_FREE;
            for (int i = 0; i < 3 && free; ++i) d_->qpos[at + i] = by(random);
            for (int i = 0; i < 4; ++i) d_->qpos[at + (free ? 3 : 0) + i] = by(random) + (i == 0 ? 1.5 : 0.0);
        }
        for (int i = 0; i < m_.nv; ++i) d_->qvel[i] = by(random);
        mj_normalizeQuat(&m_, d_->qpos);
        mj_forward(&m_, d_.get());
        return state();
    }

    void step() { mj_step(&m_, d_.get()); }
    void forward() { mj_forward(&m_, d_.get()); }
    [[nodiscard]] mjData& data() { return *d_; }
    [[nodiscard]] const JointCoordinates& joints() const { return joints_; }

    /// The scene's state where MuJoCo is.
    [[nodiscard]] State state() {
        State state = joints_.initial_state();
        T_ = MatrixXd::Zero(joints_.n(), m_.nv);
        rest_ = VectorXd::Zero(joints_.n());
        for (const TreeJoint& joint : joints_.joints()) {
            double* q = state.q.data() + joint.position;
            if (joint.joint < 0) {
                place_free(joint, q);
                continue;
            }
            if (joint.freedoms == 0) continue;
            const int j = mj_name2id(&m_, mjOBJ_JOINT, system_.joint(joint.joint).name.c_str());
            EXPECT_GE(j, 0) << system_.joint(joint.joint).name;
            if (j < 0) continue;
            if (m_.jnt_type[j] == mjJNT_BALL) {
                const int child = body_[static_cast<std::size_t>(joint.body)];
                const int parent = joint.parent < 0 ? -1 : body_[static_cast<std::size_t>(joint.parent)];
                Quaterniond turn = orientation(child);
                if (parent >= 0) turn = orientation(parent).conjugate() * turn;
                q[0] = turn.w();
                Map<Vector3d>{q + 1} = turn.vec();
                for (int i = 0; i < 3; ++i) T_(joint.column + i, m_.jnt_dofadr[j] + i) = 1.0;
                continue;
            }
            for (int i = 0; i < joint.freedoms; ++i) {  // two of a universal joint
                q[i] = d_->qpos[m_.jnt_qposadr[j + i]] - reference_[static_cast<std::size_t>(j + i)];
                T_(joint.column + i, m_.jnt_dofadr[j + i]) = 1.0;
            }
        }
        Map<VectorXd>(state.v.data(), joints_.n()) = T_ * Map<const VectorXd>(d_->qvel, m_.nv);
        return state;
    }

    /// The mass matrix in MuJoCo's coordinates, and poses of all bodies.
    void compare(const State& state) {
        ASSERT_EQ(joints_.n(), m_.nv);
        MatrixAssembler assembler;
        assembler.begin(joints_.n(), joints_.n());
        joints_.add_mass(state, 1.0, assembler);
        const MatrixXd ours = T_.transpose() * dense(assembler.finish(), joints_.n(), joints_.n()) * T_;
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> theirs(m_.nv, m_.nv);
        mj_fullM(&m_, theirs.data(), d_->qM);
        worst_mass = std::max(worst_mass, (ours - theirs).cwiseAbs().maxCoeff() / theirs.cwiseAbs().maxCoeff());
        EXPECT_LE((ours - theirs).cwiseAbs().maxCoeff(), tolerance * theirs.cwiseAbs().maxCoeff());
        const State bodies = joints_.bodies_of(state);
        for (BodyIndex body = 0; body < system_.body_count(); ++body)
            if (const int there = body_[static_cast<std::size_t>(body)]; there >= 0)
                compare_pose(system_.body(body).name, system_.pose(bodies, body), there, body);
    }

    /// Accelerations without what rows do.
    void compare_accelerations(const State& state) {
        VectorXd ours(joints_.n());
        joints_.accelerate(state, ours.data());
        const VectorXd theirs = T_ * Map<const VectorXd>(d_->qacc_smooth, m_.nv) + rest_;
        worst_acceleration = std::max(worst_acceleration, (ours - theirs).norm() / (1.0 + theirs.norm()));
        EXPECT_LE((ours - theirs).norm(), 10.0 * tolerance * (1.0 + theirs.norm()));
    }

    double tolerance;  ///< libmujoco diagonalises inertias to nine digits, and keeps meshes in single precision
    double worst_mass = 0.0, worst_pose = 0.0, worst_acceleration = 0.0;

private:
    [[nodiscard]] bool is_scalar(int j) const { return m_.jnt_type[j] == mjJNT_HINGE || m_.jnt_type[j] == mjJNT_SLIDE; }
    [[nodiscard]] Quaterniond orientation(int body) const {
        const mjtNum* q = d_->xquat + 4 * body;
        return Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    }

    // v_centre = v_origin + A (ω × c) and, of accelerations, A (ω × (ω × c)) besides.
    void place_free(const TreeJoint& joint, double* q) {
        const int there = body_[static_cast<std::size_t>(joint.body)];
        ASSERT_GE(there, 0);
        const int j = m_.body_jntadr[there], dof = m_.jnt_dofadr[j];
        ASSERT_EQ(m_.jnt_type[j], mjJNT_FREE);
        const Vector3d& c = centre_[static_cast<std::size_t>(joint.body)];
        const Quaterniond turn = orientation(there);
        const Eigen::Matrix3d A = turn.toRotationMatrix();
        Map<Vector3d>{q} = Vector3d(d_->xpos + 3 * there) + A * c;
        q[3] = turn.w();
        Map<Vector3d>{q + 4} = turn.vec();
        Eigen::Matrix3d cross;
        cross << 0.0, -c.z(), c.y(), c.z(), 0.0, -c.x(), -c.y(), c.x(), 0.0;
        T_.block<3, 3>(joint.column, dof).setIdentity();
        T_.block<3, 3>(joint.column, dof + 3) = -A * cross;
        T_.block<3, 3>(joint.column + 3, dof + 3).setIdentity();
        const Vector3d omega(d_->qvel + dof + 3);
        rest_.segment<3>(joint.column) = A * omega.cross(omega.cross(c));
    }

    void compare_pose(const std::string& name, const Pose& pose, int there, BodyIndex body) {
        const Quaterniond turn = orientation(there);
        const Vector3d place = Vector3d(d_->xpos + 3 * there) + turn * centre_[static_cast<std::size_t>(body)];
        const auto& q = pose.orientation;
        const double apart = (Vector3d(pose.position.data()) - place).norm();
        const double turned = Quaterniond(q[0], q[1], q[2], q[3]).angularDistance(turn);
        // An angle from a scalar product has half of the digits: compare vectors.
        const Quaterniond difference = Quaterniond(q[0], q[1], q[2], q[3]).conjugate() * turn;
        worst_pose = std::max({worst_pose, apart, 2.0 * difference.vec().norm()});
        EXPECT_LE(apart, 1e-10) << name;
        EXPECT_LE(2.0 * difference.vec().norm(), 1e-10) << name << " " << turned;
    }

    MultibodySystem& system_;
    const mjModel& m_;
    MjData d_;
    JointCoordinates joints_;
    std::vector<double> reference_;
    std::vector<int> body_;
    std::vector<Vector3d> centre_;  // of mass, in the frame of MuJoCo's body
    MatrixXd T_;                    // velocities of the scene from those of MuJoCo
    VectorXd rest_;                 // of accelerations
};

#endif

}  // namespace delassus::tests
