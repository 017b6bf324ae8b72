// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Presenter.h"

#include "OpenGLNumbers.h"
#include "Peeling.h"

#include "vtkOpenGLQuadHelper.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOpenGLShaderCache.h"
#include "vtkOpenGLState.h"
#include "vtkShaderProgram.h"
#include "vtkTextureObject.h"

#include <algorithm>
#include <stdexcept>

namespace
{

const char* const Fragment = "//VTK::System::Dec\n"
                             "//VTK::Output::Dec\n"
                             "in vec2 texCoord;\n"
                             "uniform sampler2D picture;\n"
                             "void main() { gl_FragData[0] = texture(picture, texCoord); }\n";

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

void Presenter::ReadDepths(
  vtkOpenGLRenderWindow* window, const Viewport& v, int across, int down, std::vector<float>& depths)
{
  // VTK's call resolves several samples to one, and disables the scissor test.
  vtkOpenGLState::ScopedglEnableDisable scissor(window->GetState(), OpenGL::ScissorTest);
  depths.resize(static_cast<std::size_t>(v.Width) * v.Height);
  if (!window->GetZbufferData(v.X, v.Y, v.X + v.Width - 1, v.Y + v.Height - 1, depths.data()))
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
    throw std::runtime_error("the window refuses the shader that draws pictures");
  }
  texture->Activate();
  this->Quad->Program->SetUniformi("picture", texture->GetTextureUnit());
  this->Quad->Render();
  texture->Deactivate();
}
