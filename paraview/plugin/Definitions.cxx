// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Definitions.h"

#include "MapperXML.h"

#include "vtkIndent.h"
#include "vtkNew.h"
#include "vtkObject.h"
#include "vtkPVXMLElement.h"
#include "vtkPVXMLParser.h"

#include <sstream>

namespace
{

// Representations of volumes, and their classes with Halite.
const std::map<std::string, std::string> Volumes = {
  { "UnstructuredGridVolumeRepresentation", "vtkHaliteVolumeRepresentation" },
  { "StructuredGridVolumeRepresentation", "vtkHaliteVolumeRepresentation" },
};

// Representations whose displays show the properties of those.
const char* const Displays[] = { "UnstructuredGridRepresentation", "StructuredGridRepresentation" };

const char* const Group = "representations";
const char* const SubProxy = "VolumeHaliteMapper";

bool Is(vtkPVXMLElement* element, const char* name)
{
  return element && element->GetName() && std::string(element->GetName()) == name;
}

std::string Attribute(vtkPVXMLElement* element, const char* name)
{
  return element->GetAttributeOrEmpty(name);
}

vtkSmartPointer<vtkPVXMLElement> Parse(const std::string& xml)
{
  vtkNew<vtkPVXMLParser> parser;
  return parser->Parse(xml.c_str()) ? parser->GetRootElement() : nullptr;
}

void Add(vtkPVXMLElement* element, const std::string& xml)
{
  element->AddNestedElement(Parse(xml));
}

std::string Text(vtkPVXMLElement* element)
{
  std::ostringstream text;
  element->PrintXML(text, vtkIndent());
  return text.str();
}

// The child of this name and, if asked for, with this value of the attribute "name"; null if there is none.
vtkPVXMLElement* Child(vtkPVXMLElement* parent, const char* name, const char* called = nullptr)
{
  for (unsigned int i = 0; parent && i < parent->GetNumberOfNestedElements(); ++i)
  {
    vtkPVXMLElement* child = parent->GetNestedElement(i);
    if (Is(child, name) && (!called || Attribute(child, "name") == called))
    {
      return child;
    }
  }
  return nullptr;
}

// The names of the mapper's properties, as it has them.
std::vector<std::string> MapperProperties()
{
  std::vector<std::string> names;
  const vtkSmartPointer<vtkPVXMLElement> mapper = Parse(MapperXML);
  for (unsigned int i = 0; i < mapper->GetNumberOfNestedElements(); ++i)
  {
    names.push_back(Attribute(mapper->GetNestedElement(i), "name"));
  }
  return names;
}

// Whether the representation has a list of mappers; Halite is in it now.
bool AddMapper(vtkPVXMLElement* representation)
{
  vtkPVXMLElement* list = Child(Child(representation, "StringVectorProperty", "SelectMapper"), "StringListDomain");
  if (!list)
  {
    return false;
  }
  Add(list, R"(<String value="Halite"/>)");
  std::string exposed;
  for (const std::string& name : MapperProperties())
  {
    exposed += "<Property name=\"" + name + "\" exposed_name=\"Halite" + name + "\"/>";
  }
  Add(representation,
    std::string("<SubProxy><Proxy name=\"") + SubProxy + "\" proxygroup=\"mappers\" proxyname=\"HaliteMapper\"/>" +
      "<ExposedProperties>" + exposed + "</ExposedProperties></SubProxy>");
  return true;
}

// Whether the display has the properties of a volume; the mapper's are among them now.
bool AddProperties(vtkPVXMLElement* display)
{
  for (unsigned int i = 0; i < display->GetNumberOfNestedElements(); ++i)
  {
    vtkPVXMLElement* part = display->GetNestedElement(i);
    if (!Is(part, "SubProxy") || !Child(part, "Proxy", "VolumeRepresentation"))
    {
      continue;
    }
    vtkPVXMLElement* group = Child(Child(part, "ExposedProperties"), "PropertyGroup");
    if (!group)
    {
      return false;
    }
    for (const std::string& name : MapperProperties())
    {
      Add(group,
        "<Property name=\"Halite" + name +
          "\" panel_visibility=\"advanced\" panel_visibility_default_for_representation=\"volume\"/>");
    }
    return true;
  }
  return false;
}

}

Definitions::Definitions() = default;
Definitions::~Definitions() = default;

void Definitions::Read(const std::string& xml)
{
  // Most of ParaView's configurations are large, and have none of these.
  if (xml.find(Group) == std::string::npos)
  {
    return;
  }
  const vtkSmartPointer<vtkPVXMLElement> root = Parse(xml);
  for (unsigned int i = 0; root && i < root->GetNumberOfNestedElements(); ++i)
  {
    vtkPVXMLElement* group = root->GetNestedElement(i);
    if (!Is(group, "ProxyGroup") || Attribute(group, "name") != Group)
    {
      continue;
    }
    for (unsigned int j = 0; j < group->GetNumberOfNestedElements(); ++j)
    {
      vtkPVXMLElement* proxy = group->GetNestedElement(j);
      const std::string name = Attribute(proxy, "name");
      const auto known = this->Representations.find(name);
      if (!Is(proxy, "Extension"))
      {
        this->Representations[name] = proxy;
      }
      else if (known != this->Representations.end())
      {
        for (unsigned int k = 0; k < proxy->GetNumberOfNestedElements(); ++k)
        {
          known->second->AddNestedElement(proxy->GetNestedElement(k));
        }
      }
    }
  }
}

std::string Definitions::WithHalite() const
{
  std::string changed;
  const auto change = [&](const std::string& name, auto how) {
    const auto known = this->Representations.find(name);
    // The definitions of this process are read again for each session, and stay as they are.
    const vtkSmartPointer<vtkPVXMLElement> proxy =
      known == this->Representations.end() ? nullptr : Parse(Text(known->second));
    if (proxy && how(proxy.Get()))
    {
      changed += Text(proxy);
    }
    else
    {
      vtkGenericWarningMacro("Halite knows no way into this ParaView's " << name << ", and is not in it");
    }
  };
  for (const auto& [name, className] : Volumes)
  {
    change(name, [&, volumeClass = className.c_str()](vtkPVXMLElement* proxy) {
      proxy->SetAttribute("class", volumeClass);
      proxy->SetAttribute("si_class", "vtkSIHaliteVolumeRepresentationProxy");
      // What has a base has the base's list.
      return proxy->GetAttribute("base_proxyname") ? true : AddMapper(proxy);
    });
  }
  for (const char* name : Displays)
  {
    change(name, AddProperties);
  }
  return std::string("<ServerManagerConfiguration><ProxyGroup name=\"mappers\">") + MapperXML +
    "</ProxyGroup><ProxyGroup name=\"" + Group + "\">" + changed + "</ProxyGroup></ServerManagerConfiguration>";
}
