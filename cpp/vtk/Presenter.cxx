// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Presenter.h"

#include "OpenGLNumbers.h"
#include "Peeling.h"

#include "vtkNew.h"
#include "vtkOpenGLQuadHelper.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOpenGLShaderCache.h"
#include "vtkOpenGLState.h"
#include "vtkPixelBufferObject.h"
#include "vtkRenderer.h"
#include "vtkShaderProgram.h"
#include "vtkTextureObject.h"

#include <algorithm>
#include <stdexcept>

namespace halite_vtk
{

namespace
{

const char* const Fragment = "//VTK::System::Dec\n"
                             "//VTK::Output::Dec\n"
                             "in vec2 texCoord;\n"
                             "uniform sampler2D picture;\n"
                             "void main() {\n"
                             "  gl_FragData[0] = texture(picture, texCoord);\n"
                             // What passes keep beside colours, such as positions, stays as it is.
                             "  gl_FragData[1] = gl_FragData[2] = gl_FragData[3] = vec4(0.0);\n"
                             "  gl_FragData[4] = gl_FragData[5] = gl_FragData[6] = gl_FragData[7] = vec4(0.0);\n"
                             "}\n";

// The depths of the frame buffer that is bound.
bool ReadBoundDepths(vtkOpenGLRenderWindow* window, const Viewport& v, std::vector<float>& depths)
{
  vtkNew<vtkTextureObject> texture;
  texture->SetContext(window);
  const auto width = static_cast<unsigned int>(v.Width), height = static_cast<unsigned int>(v.Height);
  if (!texture->AllocateDepth(width, height, vtkTextureObject::Float32))
  {
    return false;
  }
  texture->CopyFromFrameBuffer(v.X, v.Y, 0, 0, v.Width, v.Height);
  const auto packed = vtkSmartPointer<vtkPixelBufferObject>::Take(texture->Download());
  unsigned int size[2] = { width, height };
  vtkIdType steps[2] = { 0, 0 };
  return packed && packed->Download2D(VTK_FLOAT, depths.data(), size, 1, steps);
}

}

Presenter::Presenter(vtkOpenGLRenderWindow* window)
  : Window(window)
{
}

Presenter::~Presenter() = default;

vtkOpenGLRenderWindow* Presenter::GetWindow() const
{
  return this->Window;
}

Peeling& Presenter::GetPeeling()
{
  if (!this->Peels)
  {
    this->Peels.reset(new Peeling(this->Window));
  }
  return *this->Peels;
}

bool Presenter::HasContext(vtkOpenGLRenderWindow* window)
{
  if (window->IsA("vtkGenericOpenGLRenderWindow"))
  {
    return true;
  }
  window->MakeCurrent();
  return window->IsCurrent();
}

Viewport Presenter::ViewportOf(vtkOpenGLRenderWindow* window, vtkRenderer* renderer, bool isInPass)
{
  Viewport v;
  if (isInPass)
  {
    int bounds[4] = { 0, 0, 0, 0 };
    window->GetState()->vtkglGetIntegerv(OpenGL::Viewport, bounds);
    v = { bounds[0], bounds[1], bounds[2], bounds[3], true };
  }
  else
  {
    renderer->GetTiledSizeAndOrigin(&v.Width, &v.Height, &v.X, &v.Y);
  }
  return v;
}

void Presenter::ReadDepths(
  vtkOpenGLRenderWindow* window, const Viewport& v, int across, int down, std::vector<float>& depths)
{
  // VTK's call resolves several samples to one, and disables the scissor test.
  vtkOpenGLState::ScopedglEnableDisable scissor(window->GetState(), OpenGL::ScissorTest);
  depths.assign(static_cast<std::size_t>(v.Width) * v.Height, 1.0f);
  const bool isRead = v.IsOfPass
    ? ReadBoundDepths(window, v, depths)
    : window->GetZbufferData(v.X, v.Y, v.X + v.Width - 1, v.Y + v.Height - 1, depths.data()) != 0;
  if (!isRead)
  {
    throw std::runtime_error("the depth buffer of the window cannot be read");
  }
  if (across == v.Width && down == v.Height)
  {
    return;
  }
  std::vector<float> fewer(static_cast<std::size_t>(across) * down);
  for (int j = 0; j < down; ++j)
  {
    const int y = std::min(static_cast<int>((j + 0.5) * v.Height / down), v.Height - 1);
    for (int i = 0; i < across; ++i)
    {
      const int x = std::min(static_cast<int>((i + 0.5) * v.Width / across), v.Width - 1);
      fewer[static_cast<std::size_t>(j) * across + i] = depths[static_cast<std::size_t>(y) * v.Width + x];
    }
  }
  depths.swap(fewer);
}

vtkSmartPointer<vtkTextureObject> Presenter::Upload(int width, int height, const std::vector<float>& pixels)
{
  auto texture = vtkSmartPointer<vtkTextureObject>::New();
  texture->SetContext(this->Window);
  texture->SetWrapS(vtkTextureObject::ClampToEdge);
  texture->SetWrapT(vtkTextureObject::ClampToEdge);
  texture->SetMinificationFilter(vtkTextureObject::Linear);
  texture->SetMagnificationFilter(vtkTextureObject::Linear);
  if (!texture->Create2DFromRaw(width, height, 4, VTK_FLOAT, const_cast<float*>(pixels.data())))
  {
    throw std::runtime_error("the window refuses a texture of 32-bit floats");
  }
  return texture;
}

void Presenter::Present(vtkTextureObject* texture, const Viewport& v)
{
  vtkOpenGLState* state = this->Window->GetState();
  vtkOpenGLState::ScopedglViewport viewport(state);
  vtkOpenGLState::ScopedglScissor scissor(state);
  vtkOpenGLState::ScopedglEnableDisable scissorTest(state, OpenGL::ScissorTest);
  vtkOpenGLState::ScopedglEnableDisable depthTest(state, OpenGL::DepthTest);
  vtkOpenGLState::ScopedglEnableDisable blend(state, OpenGL::Blend);
  vtkOpenGLState::ScopedglEnableDisable cullFace(state, OpenGL::CullFace);
  vtkOpenGLState::ScopedglDepthMask depthMask(state);
  vtkOpenGLState::ScopedglBlendFuncSeparate blendFunction(state);

  state->vtkglViewport(v.X, v.Y, v.Width, v.Height);
  state->vtkglScissor(v.X, v.Y, v.Width, v.Height);
  state->vtkglEnable(OpenGL::ScissorTest);
  state->vtkglDisable(OpenGL::DepthTest);
  state->vtkglDisable(OpenGL::CullFace);
  state->vtkglDepthMask(0);
  state->vtkglEnable(OpenGL::Blend);
  state->vtkglBlendFuncSeparate(OpenGL::One, OpenGL::OneMinusSourceAlpha, OpenGL::One, OpenGL::OneMinusSourceAlpha);

  if (!this->Quad)
  {
    this->Quad.reset(new vtkOpenGLQuadHelper(this->Window, nullptr, Fragment, ""));
  }
  else
  {
    this->Window->GetShaderCache()->ReadyShaderProgram(this->Quad->Program);
  }
  if (!this->Quad->Program)
  {
    this->Quad.reset();
    throw std::runtime_error("the window refuses the shader that draws pictures");
  }
  texture->Activate();
  this->Quad->Program->SetUniformi("picture", texture->GetTextureUnit());
  this->Quad->Render();
  texture->Deactivate();
}

}
