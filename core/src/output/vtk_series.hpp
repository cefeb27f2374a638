// SPDX-License-Identifier: BSD-3-Clause
// Pictures of a run for ParaView: one polydata file (.vtp) a frame and system, and a collection (.pvd) with the times.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/multibody.hpp"
#include "delassus/simulation.hpp"

namespace delassus {

class DELASSUS_API VtkSeries {
public:
    /// folder: of the .vtp files; it must exist. name: of the system. system outlives the series.
    VtkSeries(std::filesystem::path folder, std::string name, const MultibodySystem& system);

    /// Writes frame `number`: the mass centres of the bodies and loose nodes as vertices, cables as lines, the surfaces
    /// of the shapes and of the elements as triangles. Cell data: body (its index; the number of bodies for what is
    /// made of nodes), speed (of its mass centre, or the mean of the nodes', m/s).
    void write(std::int64_t number, const State& state) const;

    /// Writes the contacts of frame `number` at the time t (s) as vertices, midway between the surfaces. Point data:
    /// force (N), gap (m), first and second (bodies, as in ContactRecord).
    void write_contacts(std::int64_t number, double t, const std::vector<ContactRecord>& contacts) const;

    /// About how large the file of a frame is.
    [[nodiscard]] std::int64_t picture_bytes() const;

    [[nodiscard]] std::string file_name(std::int64_t number) const;
    [[nodiscard]] std::string contacts_file_name(std::int64_t number) const;

private:
    void find_cells();

    std::filesystem::path folder_;
    std::string name_;
    const MultibodySystem& system_;
    std::vector<Mesh> surfaces_;                         // of the shapes, in the frames of their bodies
    std::vector<std::array<std::int32_t, 3>> elements_;  // surface of the elements, triangles of nodes
    std::vector<std::int32_t> loose_nodes_;
    std::vector<std::array<std::int32_t, 2>> cables_;
    // Of a file, what is the same in every frame: the counts and elements of its piece, the bytes of its cells.
    std::string counts_, elements_xml_, cells_;
};

/// One system's part of a collection.
struct VtkCollectionPart {
    const VtkSeries* series;
    const std::vector<double>* times;  ///< of the frames 0, 1, …
    bool contacts = false;             ///< whether each frame has its contacts in a file of their own
};

/// The .pvd: folder is that of the .vtp files, relative to the collection's.
DELASSUS_API void write_vtk_collection(const std::filesystem::path& file, const std::string& folder,
                                       const std::vector<VtkCollectionPart>& parts);

}  // namespace delassus
