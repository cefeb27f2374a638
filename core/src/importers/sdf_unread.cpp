// SPDX-License-Identifier: BSD-3-Clause
// libsdformat leaves out attributes that its version of SDF does not have, and keeps such elements where nobody asks
// for them. What it has and SdfReader does not take is listed here as well.
#include "importers/sdf_unread.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <set>

#include "importers/xml_known.hpp"

namespace delassus::importers {

namespace {

// SDF 1.12. What is marked ~ has no effect on the motion, or is listed by SdfReader where it has.
constexpr std::array<KnownElement, 33> sdf_elements = {{
    {"sdf", "version", "world model actor~ light~"},
    {"world", "name",
     "gravity physics include model frame actor~ light~ plugin~ road~ scene~ gui~ audio~ wind~ magnetic_field~ "
     "atmosphere~ "
     "spherical_coordinates~"},
    {"physics", "name default type",
     "max_step_size real_time_factor real_time_update_rate max_contacts dart~ simbody~ bullet~ ode~"},
    {"include", "merge", "uri name static placement_frame pose plugin~ experimental:params~"},
    {"model", "name canonical_link placement_frame",
     "static self_collide allow_auto_disable enable_wind~ include model frame pose link joint plugin~"},
    {"frame", "name attached_to", "pose"},
    {"pose", "relative_to rotation_format degrees frame", ""},
    {"link", "name",
     "pose inertial collision gravity kinematic~ velocity_decay~ enable_wind~ self_collide=false "
     "must_be_base_link=false "
     "visual~ sensor~ light~ projector~ audio_sink~ audio_source~ battery~ particle_emitter~ plugin~"},
    {"inertial", "auto=false", "mass pose inertia density~ auto_inertia_params~"},  // both of auto alone
    {"inertia", "", "ixx ixy ixz iyy iyz izz"},
    {"collision", "name", "pose geometry surface laser_retro~ max_contacts~ density~ auto_inertia_params~"},
    {"geometry", "", "empty box sphere cylinder capsule ellipsoid plane mesh heightmap~ polyline~"},
    {"box", "", "size"},
    {"sphere", "", "radius"},
    {"cylinder", "", "radius length"},
    {"capsule", "", "radius length"},
    {"ellipsoid", "", "radii"},
    {"plane", "", "normal size"},
    {"mesh", "", "uri scale submesh~"},
    {"surface", "", "bounce friction contact soft_contact~"},
    {"bounce", "", "restitution_coefficient threshold"},
    {"friction", "", "ode bullet torsional~"},
    {"friction/ode", "", "mu mu2 fdir1~ slip1~ slip2~"},
    {"friction/bullet", "", "friction friction2 fdir1~ rolling_friction=0"},
    {"contact", "",
     "collide_bitmask category_bitmask=65535 collide_without_contact=false collide_without_contact_bitmask "
     "poissons_ratio "
     "elastic_modulus=-1 ode~ bullet~"},
    {"joint", "name type",
     "parent child pose axis axis2 physics thread_pitch~ screw_thread_pitch~ gearbox_ratio~ gearbox_reference_body~ "
     "sensor~"},
    {"axis", "", "xyz dynamics limit initial_position=0 use_parent_model_frame"},
    {"axis2", "", "xyz dynamics limit initial_position=0 use_parent_model_frame"},
    {"xyz", "expressed_in", ""},
    {"dynamics", "", "damping friction spring_reference spring_stiffness"},
    {"limit", "", "lower upper effort velocity stiffness=1e8 dissipation=1"},
    {"joint/physics", "", "ode simbody~ provide_feedback"},
    {"physics/ode", "",
     "cfm_damping~ implicit_spring_damper~ fudge_factor~ cfm~ erp~ max_force~ limit~ suspension~ provide_feedback "
     "bounce=0 "
     "velocity=0"},
}};
constexpr int latest = 12;  // of 1.x

void find_files(const sdf::ElementPtr& element, std::set<std::filesystem::path>& files) {
    if (!element) return;
    if (!element->FilePath().empty()) files.insert(std::filesystem::weakly_canonical(element->FilePath()));
    for (sdf::ElementPtr child = element->GetFirstElement(); child; child = child->GetNextElement())
        find_files(child, files);
}

/// Files of versions before 1.4 have other elements, which libsdformat translates.
bool has_todays_names(const XmlElement& root, model_import::Model& model) {
    int major = 0, minor = 0;
    const std::string version = root.text("version");
    if (std::sscanf(version.c_str(), "%d.%d", &major, &minor) < 1) return true;
    if (major > 1 || minor > latest)
        model.lose(
            fmt::format("version {} of SDF", version),
            fmt::format("it is known here up to 1.{}: what means another thing since is read as before", latest));
    return major > 1 || minor >= 4;
}

}  // namespace

void note_unread_sdf(const sdf::Root& root, const std::filesystem::path& file, model_import::Model& model) {
    std::set<std::filesystem::path> files = {std::filesystem::weakly_canonical(file)};
    find_files(root.Element(), files);
    for (std::uint64_t k = 0; k < root.WorldCount(); ++k) find_files(root.WorldByIndex(k)->Element(), files);
    if (root.Model() != nullptr) find_files(root.Model()->Element(), files);
    for (const auto& one : files) {
        const XmlElement read = read_xml(one, one.filename().string());
        if (read.name == "sdf" && has_todays_names(read, model)) note_unknown(read, sdf_elements, "SDF", model);
    }
}

}  // namespace delassus::importers
