// SPDX-License-Identifier: BSD-3-Clause
// A Spec, which an MJCF file says, as a Model.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "importers/mjcf_place.hpp"
#include "importers/mjcf_spec.hpp"
#include "model_import/model.hpp"

namespace delassus::importers {

using model_import::Model;
using model_import::ModelBody;
using model_import::ModelJoint;
using model_import::ModelShape;

class MjcfReader {
public:
    /// keyframe: empty, or a name, or a number. All outlive the reader.
    MjcfReader(mjcf::Spec& spec, const ImportSettings& settings, Model& model);
    void read();

private:
    using Vector3d = model_import::Vector3d;
    using Quaterniond = model_import::Quaterniond;
    using Matrix3d = model_import::Matrix3d;

    void give_names();
    void find_keyframe(const std::string& keyframe);
    void read_options();
    void read_body(std::size_t body);
    void lose_of_free_joint(const mjcf::Joint& joint);
    void read_joint(const mjcf::Joint& joint, ModelJoint& result);
    void read_coordinate(const mjcf::Joint& joint, const std::string& what, JointParameters& result);

    // mjcf_contact.cpp
    void find_pairs();
    void read_materials();
    void read_shapes();
    void read_shape(std::size_t geom);
    [[nodiscard]] const mjcf::Pair* pair_of(std::size_t first, std::size_t second) const;
    /// Whether MuJoCo looks for contacts of two geoms; by masks alone: whatever their bodies are.
    [[nodiscard]] bool touches(std::size_t first, std::size_t second) const;
    [[nodiscard]] bool masks_touch(std::size_t first, std::size_t second) const;
    [[nodiscard]] bool bodies_touch(std::int32_t first, std::int32_t second) const;
    void read_touching();
    void note_softness(const mjcf::Geom& geom);

    // mjcf_forces.cpp
    void read_equalities();
    void read_loop(const mjcf::Equality& equality, const std::string& name);
    void read_joint_equality(const mjcf::Equality& equality, const std::string& name);
    void read_actuators();
    void read_actuator(const mjcf::Actuator& actuator, double control, const std::string& name);
    void note_others();

    [[nodiscard]] const mjcf::Body& body_at(std::int32_t body) const {
        return spec_.bodies[static_cast<std::size_t>(body)];
    }
    [[nodiscard]] bool moves(std::int32_t body) const {
        const std::int32_t weld = body_at(body).weld;
        return weld != 0 && !body_at(weld).mocap;
    }
    /// The body of MuJoCo whose shapes this one's are: that which it is welded to, or itself where the world holds it.
    [[nodiscard]] std::int32_t owner(std::int32_t body) const { return moves(body) ? body_at(body).weld : body; }
    /// The number of a body of the model; −1 for one that the world holds.
    [[nodiscard]] std::int32_t moving_body(std::int32_t body) const {
        return moves(body) ? body_[static_cast<std::size_t>(body)] : -1;
    }

    mjcf::Spec& spec_;
    Model& model_;
    const mjcf::Key* key_ = nullptr;
    bool inputs_;
    std::vector<mjcf::Placed> placed_;
    std::vector<const mjcf::Joint*> joints_;
    std::vector<const mjcf::Geom*> geoms_;
    std::vector<std::int32_t> body_, joint_;  // numbers in the model by those of the Spec; −1: none
    std::vector<int> class_;                  // material of each geom
    std::vector<char> is_shape_;              // whether a geom is a shape of the scene
    std::map<std::pair<std::size_t, std::size_t>, const mjcf::Pair*> pairs_;  // of geoms, the lesser number first
    model_import::Names body_names_, joint_names_, force_names_;
};

}  // namespace delassus::importers
