// SPDX-License-Identifier: BSD-3-Clause
// An mjModel, which the compiler of libmujoco made of an MJCF file, as a Model.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "model_import/model.hpp"

namespace delassus::importers {

using model_import::Matrix3d;
using model_import::Model;
using model_import::ModelBody;
using model_import::ModelJoint;
using model_import::ModelShape;
using model_import::Quaterniond;
using model_import::Vector3d;

class MjcfReader {
public:
    /// m: compiled; keyframe: empty or a name or a number. All outlive the reader.
    MjcfReader(const mjModel& m, const std::string& keyframe, Model& model);
    void read();

private:
    void find_keyframe(const std::string& keyframe);
    /// data_ ← where the coordinates of hinges and slides are those of the reference, and free bodies and balls where
    /// the scene starts.
    void place();
    void read_options();
    void read_body(int body);
    void read_joint(int joint, ModelJoint& result);
    void read_coordinate(int joint, const std::string& name, JointParameters& result);

    // mjcf_contact.cpp
    void read_materials();
    void read_shapes();
    void read_shape(int geom);
    [[nodiscard]] bool touches(int first, int second) const;
    void read_touching();
    void note_softness(int geom);

    // mjcf_forces.cpp
    void read_equalities();
    void read_joint_equality(int equality, const std::string& name);
    void read_actuators();
    void read_actuator(int actuator, const std::string& name);
    void note_others();

    [[nodiscard]] bool disabled(mjtDisableBit flag) const { return (m_.opt.disableflags & flag) != 0; }
    [[nodiscard]] bool moves(int body) const { return m_.body_weldid[body] != 0; }
    /// Its own name, or its kind with its number.
    [[nodiscard]] std::string name_of(mjtObj kind, int index) const;
    /// kind "name", for reports.
    [[nodiscard]] std::string item(const char* kind, mjtObj type, int index) const;
    /// The number of a body of the model; −1 for one that the world holds.
    [[nodiscard]] std::int32_t moving_body(int body) const {
        return moves(body) ? body_[static_cast<std::size_t>(body)] : -1;
    }

    const mjModel& m_;
    Model& model_;
    std::unique_ptr<mjData, void (*)(mjData*)> data_;
    int key_ = -1;
    std::vector<std::int32_t> body_, joint_;  // numbers in the model by those of MuJoCo; −1: none
    std::vector<double> reference_;           // of hinges and slides: the coordinate where they are 0 in the scene
    std::vector<int> class_;                  // material of each geom
    std::vector<char> is_shape_;              // whether a geom is a shape of the scene
    model_import::Names body_names_, joint_names_, force_names_;
};

// Of contacts, limits and equalities, where the model says nothing.
inline constexpr std::array<mjtNum, mjNREF> usual_solref = {0.02, 1.0};
inline constexpr std::array<mjtNum, mjNIMP> usual_solimp = {0.9, 0.95, 0.001, 0.5, 2.0};

inline Vector3d vector_at(const mjtNum* from, int index) {
    return Vector3d(from + 3 * index);
}
inline Quaterniond quaternion_at(const mjtNum* from, int index) {
    const mjtNum* q = from + 4 * index;
    return {q[0], q[1], q[2], q[3]};
}

}  // namespace delassus::importers
