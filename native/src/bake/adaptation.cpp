// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/adaptation.h"

#include <algorithm>
#include <array>

namespace raybundle {

namespace {

const Mesh& meshOf(const Scene& scene, size_t instance) {
    return scene.meshes[size_t(scene.instances[instance].mesh)];
}

}  // namespace

bool areAnyFiner(const Scene& scene, const std::vector<FinerMesh>& adapted) {
    for (size_t i = 0; i < adapted.size(); ++i)
        if (adapted[i].isFinerThan(meshOf(scene, i))) return true;
    return false;
}

Scene adaptedScene(const Scene& scene, const std::vector<FinerMesh>& adapted) {
    Scene result = scene;
    for (size_t i = 0; i < adapted.size(); ++i) {
        if (!adapted[i].isFinerThan(meshOf(scene, i))) continue;
        result.meshes.push_back(adapted[i].withAttributesOf(meshOf(scene, i)));
        result.instances[i].mesh = int32_t(result.meshes.size()) - 1;
        result.instances[i].isAdapted = true;
    }
    return result;
}

std::vector<InstanceLight> atSources(const std::vector<InstanceLight>& light,
                                     const std::vector<FinerMesh>& adapted) {
    std::vector<InstanceLight> result = light;
    for (size_t i = 0; i < light.size(); ++i) {
        const FinerMesh& mesh = adapted[i];
        if (mesh.faceCount() == 0 || light[i].direct.empty()) continue;
        CornerLight& out = result[i];
        std::vector<float> count(mesh.sourceCornerCount, 0.0f);
        for (std::vector<glm::vec3>* values : {&out.direct, &out.indirect, &out.exitance})
            values->assign(count.size(), glm::vec3(0.0f));
        for (size_t c = 0; c < mesh.sourceCorners.size(); ++c) {
            if (mesh.sourceWeights[c] != std::array<float, 3>{1, 0, 0}) continue;
            const size_t source = size_t(mesh.sourceCorners[c][0]);
            count[source] += 1;
            out.direct[source] += light[i].direct[c];
            out.indirect[source] += light[i].indirect[c];
            out.exitance[source] += light[i].exitance[c];
        }
        for (size_t c = 0; c < count.size(); ++c)
            for (std::vector<glm::vec3>* values : {&out.direct, &out.indirect, &out.exitance})
                (*values)[c] /= std::max(count[c], 1.0f);
    }
    return result;
}

Progress FirstPassProgress::progress() {
    if (!callers.isHeard()) return {};
    return Progress(
        [](void* user, rb_stage stage, double fraction) {
            auto& self = *static_cast<FirstPassProgress*>(user);
            constexpr double kStages = RB_STAGE_RECONSTRUCTION + 1;
            self.most = std::max(self.most, (double(stage) + fraction) / kStages);
            return self.callers.tell(RB_STAGE_PATCHES, self.most);
        },
        this);
}

void addFirstPass(const Report& first, Report& second) {
    for (size_t stage = 0; stage < second.seconds.size(); ++stage)
        second.seconds[stage] += first.seconds[stage];
    second.totalSeconds += first.totalSeconds;
    second.shadowRays += first.shadowRays;
    for (size_t i = 0; i < second.objects.size(); ++i)
        second.objects[i].adaptiveVertices = first.objects[i].adaptiveVertices;
    for (const Warning& warning : first.warnings)
        if (warning.id == WarningId::MAX_VERTICES) second.warnings.push_back(warning);
}

}  // namespace raybundle
