/* Calls of the package's rules for bonded engines (concordem/yade/_rules.py), which both forms of the engine share.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include <core/Engine.hpp>
#include <core/Scene.hpp>
#include <lib/pyutil/gil.hpp>

namespace yade {

/* Call a function of the package, which has the rules of both bonded engines; its exception becomes a C++ exception. */
template <class Call> void inPython(Call call)
{
	const gilLock lock;
	try {
		call(boost::python::import("concordem.yade._rules"));
	} catch (const boost::python::error_already_set&) {
		PyObject *type = nullptr, *value = nullptr, *trace = nullptr;
		PyErr_Fetch(&type, &value, &trace);
		PyErr_NormalizeException(&type, &value, &trace);
		const boost::python::handle<> kept(boost::python::allow_null(value)), kind(boost::python::allow_null(type)), where(boost::python::allow_null(trace));
		const string text = value ? boost::python::extract<string>(boost::python::str(boost::python::object(kept)))() : string("an error of Python");
		throw std::runtime_error("BondedEngine_Rust: " + text);
	}
}

/* O.engines. After a step that failed, YADE keeps a new list aside until the next one. */
inline const vector<shared_ptr<Engine>>& enginesOf(const Scene& scene) { return scene._nextEngines.empty() ? scene.engines : scene._nextEngines; }

inline boost::python::list listOf(const vector<shared_ptr<Engine>>& engines)
{
	boost::python::list found;
	for (const auto& engine : engines)
		found.append(engine);
	return found;
}

} // namespace yade
