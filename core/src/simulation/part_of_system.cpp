// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/part_of_system.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace delassus {

namespace {

/// Builds the part, one kind of item after the other.
class PartBuilder {
public:
    PartBuilder(const SceneSystem& whole, const std::vector<BodyIndex>& moving)
        : whole_(whole), mechanics_(*whole.system), number_(whole.bodies.size(), absent) {
        part_.system = std::make_unique<MultibodySystem>();
        part_.system->set_gravity(mechanics_.gravity());
        for (const SceneMaterial& material : whole_.materials) part_.system->add_material(material.contact);
        for (const SceneMaterialPair& pair : whole_.material_pairs)
            part_.system->set_material_pair(pair.first, pair.second, pair.contact);
        add_bodies(moving);
        add_joints();
        add_drives();
        add_forces();
        add_shapes();
        for (const auto& [first, second] : whole_.apart)
            if (has(first) && has(second)) part_.system->keep_apart(local(first), local(second));
        if (!whole_.leave_out) part_.system->leave_nothing_out();
        if (const auto given = mechanics_.given_envelope()) part_.system->set_envelope(*given);
        part_.system->finish();
    }

    PartOfSystem finish(const std::vector<BodyIndex>& touched) {
        for (const BodyIndex body : touched) numbers_.touched.push_back(local(body));
        part_.shapes = numbers_.shapes;
        keep_rows();
        find_angles();
        part_.system->be_part_of(mechanics_, std::move(numbers_));
        return std::move(part_);
    }

private:
    static constexpr BodyIndex absent = -2;

    [[nodiscard]] bool has(BodyIndex body) const {
        return body == world_body || number_[static_cast<std::size_t>(body)] != absent;
    }
    [[nodiscard]] BodyIndex local(BodyIndex body) const {
        return body == world_body ? world_body : number_[static_cast<std::size_t>(body)];
    }
    [[nodiscard]] std::int32_t joint(std::int32_t index) const { return joint_[static_cast<std::size_t>(index)]; }

    void add_bodies(const std::vector<BodyIndex>& moving) {
        auto next = moving.begin();
        for (std::size_t k = 0; k < whole_.bodies.size(); ++k) {
            const auto body = static_cast<BodyIndex>(k);
            const bool wanted = next != moving.end() && *next == body;
            if (wanted) ++next;
            if (!wanted && mechanics_.body_column(body) >= 0) continue;
            number_[k] = part_.system->add_body(whole_.bodies[k]);
            part_.bodies.push_back(body);
        }
    }

    void add_joints() {
        for (std::size_t k = 0; k < whole_.joints.size(); ++k) {
            JointParameters parameters = whole_.joints[k];
            joint_.push_back(-1);
            if (parameters.kind == JointKind::Gear) {
                parameters.gear_first = joint(parameters.gear_first);
                parameters.gear_second = joint(parameters.gear_second);
                if (parameters.gear_first < 0 || parameters.gear_second < 0) continue;
            } else {
                if (!has(parameters.first) || !has(parameters.second)) continue;
                parameters.first = local(parameters.first);
                parameters.second = local(parameters.second);
            }
            joint_.back() = part_.system->add_joint(parameters);
            numbers_.joints.push_back(static_cast<std::int32_t>(k));
        }
    }

    void add_drives() {
        const auto add = [&](const auto& all, std::vector<std::int32_t>& bounded, const auto& put) {
            std::int32_t number = 0;
            for (auto parameters : all) {
                const bool has_limit = !std::isinf(parameters.force_limit);
                parameters.joint = joint(parameters.joint);
                if (parameters.joint >= 0) {
                    put(parameters);
                    if (has_limit) bounded.push_back(number);
                }
                if (has_limit) ++number;
            }
        };
        add(whole_.motors, numbers_.motors, [&](const MotorParameters& one) { part_.system->add_motor(one); });
        add(whole_.actuators, numbers_.actuators,
            [&](const ActuatorParameters& one) { part_.system->add_actuator(one); });
    }

    void add_forces() {
        const auto add_between = [&](const auto& all, const auto& put) {
            for (auto parameters : all) {
                if (!has(parameters.first) || !has(parameters.second)) continue;
                parameters.first = local(parameters.first);
                parameters.second = local(parameters.second);
                put(parameters);
            }
        };
        add_between(whole_.springs, [&](const SpringParameters& one) { part_.system->add_spring(one); });
        add_between(whole_.bushings, [&](const BushingParameters& one) { part_.system->add_bushing(one); });
        for (LoadParameters load : whole_.loads) {
            if (!has(load.body)) continue;
            load.body = local(load.body);
            part_.system->add_load(load);
        }
    }

    void add_shapes() {
        const auto& shapes = mechanics_.shapes();
        for (std::size_t k = 0; k < shapes.size(); ++k) {
            if (!has(shapes[k].body)) continue;
            Shape shape = shapes[k];
            shape.body = local(shape.body);
            part_.system->add_shape(shape, whole_.shape_material[k]);
            numbers_.shapes.push_back(static_cast<std::int32_t>(k));
        }
    }

    void keep_rows() {
        const std::vector<std::int32_t>& kept = mechanics_.kept_rows();
        std::vector<std::int32_t> own;
        for (std::size_t k = 0; k < numbers_.joints.size(); ++k) {
            const auto [first, count] = mechanics_.joint_rows(numbers_.joints[k]);
            const auto [own_first, own_count] = part_.system->joint_rows(static_cast<std::int32_t>(k));
            for (std::int32_t i = 0; i < std::min(count, own_count); ++i) {
                const auto place = std::lower_bound(kept.begin(), kept.end(), first + i);
                if (place == kept.end() || *place != first + i) continue;
                own.push_back(own_first + i);
                part_.rows.push_back(static_cast<std::int32_t>(place - kept.begin()));
            }
        }
        part_.system->keep_rows(own);
    }

    void find_angles() {
        std::vector<std::array<std::int32_t, 2>> places;  // in the part, in the whole
        for (std::size_t k = 0; k < numbers_.joints.size(); ++k)
            if (const std::int32_t own = part_.system->angle_position(static_cast<std::int32_t>(k)); own >= 0)
                places.push_back({own, mechanics_.angle_position(numbers_.joints[k])});
        std::sort(places.begin(), places.end());
        for (const auto& place : places) part_.angles.push_back(place[1]);
    }

    const SceneSystem& whole_;
    const MultibodySystem& mechanics_;
    std::vector<BodyIndex> number_;    ///< in the part, of each body of the whole
    std::vector<std::int32_t> joint_;  ///< in the part, of each joint of the whole; −1: not in it
    MultibodySystem::PartNumbers numbers_;
    PartOfSystem part_;
};

}  // namespace

PartOfSystem part_of_system(const SceneSystem& whole, const std::vector<BodyIndex>& moving,
                            const std::vector<BodyIndex>& touched) {
    return PartBuilder(whole, moving).finish(touched);
}

}  // namespace delassus
