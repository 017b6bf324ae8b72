// SPDX-License-Identifier: MIT OR Apache-2.0
// The pass means its questions for the shaders of VTK's own mapper of image data: it has textures of depths, names them
// in a shader's declarations, and sets them as that shader's parameters. A shader here writes the depths out instead.
#include "Peeling.h"

#include "OpenGLNumbers.h"

#include "vtkDualDepthPeelingPass.h"
#include "vtkInformation.h"
#include "vtkInformationObjectBaseVectorKey.h"
#include "vtkNew.h"
#include "vtkOpenGLFramebufferObject.h"
#include "vtkOpenGLQuadHelper.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOpenGLShaderCache.h"
#include "vtkOpenGLState.h"
#include "vtkPixelBufferObject.h"
#include "vtkRenderState.h"
#include "vtkRenderer.h"
#include "vtkShaderProgram.h"
#include "vtkTextureObject.h"
#include "vtkVolume.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>

namespace halite_vtk
{

namespace
{

// An outer depth is a layer that was peeled, an inner one the next; in front they are negative, and -1 is none.
const char* const IntervalShaders[] = {
  "//VTK::System::Dec\n"
  "//VTK::Output::Dec\n"
  "in vec2 texCoord;\n"
  "uniform sampler2D innerDepthTex, outerDepthTex;\n"
  "void main() {\n"
  "  vec2 layers = texture(innerDepthTex, texCoord).xy;\n"
  "  float opaque = texture(outerDepthTex, texCoord).y;\n"
  "  float end = opaque < 0.0 ? 1.0 : opaque;\n"
  "  gl_FragData[0] = layers.x == -1.0 ? vec4(0.0, 0.0, 0.0, end) : vec4(0.0, -layers.x, layers.y, end);\n"
  "}\n",
  "//VTK::System::Dec\n"
  "//VTK::Output::Dec\n"
  "in vec2 texCoord;\n"
  "uniform sampler2D innerDepthTex, outerDepthTex, opaqueDepthTex;\n"
  "void main() {\n"
  "  vec2 next = texture(innerDepthTex, texCoord).xy;\n"
  "  vec2 last = texture(outerDepthTex, texCoord).xy;\n"
  "  float opaque = texture(opaqueDepthTex, texCoord).x;\n"
  "  bool none = next.x == -1.0;\n"
  "  float end = none ? last.y : -next.x;\n"
  "  vec4 intervals = vec4(-last.x, min(end, opaque), 0.0, 0.0);\n"
  "  if (!none && end < opaque) { intervals.zw = vec2(next.y, last.y); }\n"
  "  gl_FragData[0] = last.x == -1.0 ? vec4(0.0) : intervals;\n"
  "}\n",
  "//VTK::System::Dec\n"
  "//VTK::Output::Dec\n"
  "in vec2 texCoord;\n"
  "uniform sampler2D depthRangeTex;\n"
  "void main() {\n"
  "  vec2 left = texture(depthRangeTex, texCoord).xy;\n"
  "  gl_FragData[0] = left.x == -1.0 ? vec4(0.0) : vec4(0.0, 0.0, -left.x, left.y);\n"
  "}\n",
};

// A picture goes over what other volumes have left in this stage, VTK's among them, as they come from far to near; their
// targets start empty, in front of the layers with what was peeled before. What lies before all layers may be kept until the
// first layer was drawn: VTK's layers have 8 bits, and what is written less often is rounded less often. Then the volume
// must be alone, as it takes the place of all that was there.
const char* const CompositeShaders[] = {
  "//VTK::System::Dec\n"
  "//VTK::Output::Dec\n"
  "in vec2 texCoord;\n"
  "uniform sampler2D front, back;\n"
  "void main() {\n"
  "  gl_FragData[0] = texture(back, texCoord);\n"
  "  gl_FragData[1] = texture(front, texCoord);\n"
  "}\n",
  "//VTK::System::Dec\n"
  "//VTK::Output::Dec\n"
  "in vec2 texCoord;\n"
  "uniform sampler2D kept, front, back, lastFrontColorTex;\n"
  "uniform int alone;\n"
  "void main() {\n"
  "  gl_FragData[0] = texture(back, texCoord);\n"
  "  vec4 before = texture(kept, texCoord);\n"
  "  vec4 last = texture(lastFrontColorTex, texCoord);\n"
  "  vec4 new = texture(front, texCoord);\n"
  "  gl_FragData[1] = alone != 0 ? before + (1.0 - before.a) * (last + (1.0 - last.a) * new)\n"
  "                              : vec4(last.rgb * new.a + (1.0 - last.a) * new.rgb, new.a);\n"
  "}\n",
  "//VTK::System::Dec\n"
  "//VTK::Output::Dec\n"
  "in vec2 texCoord;\n"
  "uniform sampler2D back;\n"
  "void main() { gl_FragData[0] = texture(back, texCoord); }\n",
};

// What only classes derived from the pass may see of it, and it offers nobody else.
struct OpenedPass : vtkDualDepthPeelingPass
{
  static void Restore(vtkDualDepthPeelingPass* pass)
  {
    const vtkRenderState* state = pass->*&OpenedPass::RenderState;
    if (!state)
    {
      return;
    }
    auto window = static_cast<vtkOpenGLRenderWindow*>(state->GetRenderer()->GetRenderWindow());
    vtkOpenGLState*& known = pass->*&OpenedPass::State;
    if (known != window->GetState())
    {
      known = window->GetState();
      (pass->*&OpenedPass::InitFramebuffer)(state);
      (pass->*&OpenedPass::Framebuffer)->Bind(OpenGL::DrawFramebuffer);
    }
    auto& textures = pass->*&OpenedPass::Textures;
    if (textures[Back])
    {
      return;
    }
    std::generate(std::begin(textures), std::end(textures), &vtkTextureObject::New);
    for (TextureName color : { BackTemp, Back, FrontA, FrontB })
    {
      (pass->*&OpenedPass::InitColorTexture)(textures[color], state);
    }
    for (TextureName depth : { DepthA, DepthB })
    {
      (pass->*&OpenedPass::InitDepthTexture)(textures[depth], state);
    }
    (pass->*&OpenedPass::InitOpaqueDepthTexture)(textures[OpaqueDepth], state);
  }
};

}

Peeling::Peeling(vtkOpenGLRenderWindow* window)
  : Window(window)
{
}

Peeling::~Peeling() = default;

vtkOpenGLRenderPass* Peeling::PassOf(vtkAbstractMapper* mapper, vtkVolume* volume)
{
  vtkInformation* keys = volume->GetPropertyKeys();
  vtkInformationObjectBaseVectorKey* passes = vtkOpenGLRenderPass::RenderPasses();
  for (int i = 0; keys && keys->Has(passes) && i < passes->Size(keys); ++i)
  {
    if (auto pass = vtkDualDepthPeelingPass::SafeDownCast(passes->Get(keys, i)))
    {
      return StageOf(pass, mapper, volume) == Unknown ? nullptr : pass;
    }
  }
  return nullptr;
}

void Peeling::Restore(vtkOpenGLRenderPass* pass)
{
  if (auto dual = vtkDualDepthPeelingPass::SafeDownCast(pass))
  {
    OpenedPass::Restore(dual);
  }
}

Peeling::Stage Peeling::StageOf(vtkOpenGLRenderPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume)
{
  std::string vertex, geometry, fragment = "//VTK::DepthPeeling::Dec\n";
  pass->PreReplaceShaderValues(vertex, geometry, fragment, mapper, volume);
  const auto declares = [&](const char* name) { return fragment.find(name) != std::string::npos; };
  return declares("lastFrontColorTex") ? Between
    : declares("depthRangeTex")        ? Rest
    : declares("outerDepthTex")        ? Outside
                                       : Unknown;
}

vtkOpenGLQuadHelper& Peeling::Ready(std::unique_ptr<vtkOpenGLQuadHelper>& quad, const char* fragment)
{
  if (!quad)
  {
    quad.reset(new vtkOpenGLQuadHelper(this->Window, nullptr, fragment, ""));
  }
  else
  {
    this->Window->GetShaderCache()->ReadyShaderProgram(quad->Program);
  }
  if (!quad->Program)
  {
    quad.reset();
    throw std::runtime_error("the window refuses the shaders for depth peeling");
  }
  return *quad;
}

void Peeling::ReadIntervals(vtkOpenGLRenderPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume, int width,
  int height, std::vector<Intervals>& intervals)
{
  this->Now = StageOf(pass, mapper, volume);
  vtkOpenGLState* state = this->Window->GetState();
  vtkOpenGLState::ScopedglViewport viewport(state);
  vtkOpenGLState::ScopedglEnableDisable scissorTest(state, OpenGL::ScissorTest);
  vtkOpenGLState::ScopedglEnableDisable depthTest(state, OpenGL::DepthTest);
  vtkOpenGLState::ScopedglEnableDisable blend(state, OpenGL::Blend);
  vtkOpenGLState::ScopedglEnableDisable cullFace(state, OpenGL::CullFace);
  for (unsigned int setting : { OpenGL::ScissorTest, OpenGL::DepthTest, OpenGL::Blend, OpenGL::CullFace })
  {
    state->vtkglDisable(setting);
  }
  state->vtkglViewport(0, 0, width, height);

  vtkNew<vtkTextureObject> depths;
  depths->SetContext(this->Window);
  vtkNew<vtkOpenGLFramebufferObject> buffer;
  buffer->SetContext(this->Window);
  if (!depths->Allocate2D(width, height, 4, VTK_FLOAT))
  {
    throw std::runtime_error("the window refuses a texture of 32-bit floats");
  }
  vtkOpenGLQuadHelper& quad = this->Ready(this->IntervalShaders[this->Now], halite_vtk::IntervalShaders[this->Now]);
  state->PushFramebufferBindings();
  buffer->Bind();
  buffer->AddColorAttachment(0, depths);
  buffer->ActivateDrawBuffer(0);
  pass->SetShaderParameters(quad.Program, mapper, volume);
  quad.Render();
  buffer->RemoveColorAttachment(0);
  state->PopFramebufferBindings();

  static_assert(sizeof(Intervals) == 4 * sizeof(float), "four depths are read at once");
  intervals.resize(static_cast<std::size_t>(width) * height);
  auto packed = vtkSmartPointer<vtkPixelBufferObject>::Take(depths->Download());
  unsigned int size[2] = { static_cast<unsigned int>(width), static_cast<unsigned int>(height) };
  vtkIdType steps[2] = { 0, 0 };
  const bool read = packed && packed->Download2D(VTK_FLOAT, intervals.data(), size, 4, steps);
  buffer->ReleaseGraphicsResources(this->Window);
  if (!read)
  {
    throw std::runtime_error("the depths of translucent surfaces cannot be read");
  }
}

void Peeling::Composite(vtkOpenGLRenderPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume, bool isAlone,
  vtkTextureObject* kept, vtkTextureObject* front, vtkTextureObject* back)
{
  vtkOpenGLState* state = this->Window->GetState();
  vtkOpenGLState::ScopedglEnableDisable depthTest(state, OpenGL::DepthTest);
  vtkOpenGLState::ScopedglEnableDisable blend(state, OpenGL::Blend);
  vtkOpenGLState::ScopedglEnableDisable cullFace(state, OpenGL::CullFace);
  vtkOpenGLState::ScopedglBlendFuncSeparate blendFunction(state);
  state->vtkglDisable(OpenGL::DepthTest);
  state->vtkglDisable(OpenGL::CullFace);
  const bool replaces = isAlone && this->Now == Between;
  replaces ? state->vtkglDisable(OpenGL::Blend) : state->vtkglEnable(OpenGL::Blend);
  state->vtkglBlendFuncSeparate(OpenGL::One, OpenGL::OneMinusSourceAlpha, OpenGL::One, OpenGL::OneMinusSourceAlpha);
  state->vtkglBlendEquation(OpenGL::Add);

  vtkOpenGLQuadHelper& quad = this->Ready(this->CompositeShaders[this->Now], halite_vtk::CompositeShaders[this->Now]);
  pass->SetShaderParameters(quad.Program, mapper, volume);
  vtkTextureObject* const textures[] = { kept, front, back };
  const char* const names[] = { "kept", "front", "back" };
  for (int k = 0; k < 3; ++k)
  {
    textures[k]->Activate();
    quad.Program->SetUniformi(names[k], textures[k]->GetTextureUnit());
  }
  quad.Program->SetUniformi("alone", isAlone);
  quad.Render();
  for (vtkTextureObject* texture : textures)
  {
    texture->Deactivate();
  }
  // What the pass has set for volumes.
  state->vtkglBlendEquation(this->Now == Rest ? OpenGL::Add : OpenGL::Largest);
}

}
