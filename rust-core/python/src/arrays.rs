//! Conversion from and to NumPy arrays.

use bytemuck::Pod;
use concordem::math::{Mat3, Vec3};
use nalgebra::Matrix6;
use numpy::{
    Element, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The Python object as a contiguous array of `dtype`; not copied if it already is one.
fn contiguous<'py>(object: &Bound<'py, PyAny>, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    let numpy = object.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (object,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let wanted = match dtype {
        "float64" => "fiu",
        "bool" => "b",
        _ => "iu",
    };
    // NumPy converts an empty list to reals, whatever it is meant for.
    if !wanted.contains(&kind) && array.getattr("size")?.extract::<usize>()? > 0 {
        return Err(PyTypeError::new_err(format!(
            "the array has type {}, which does not convert to {dtype}",
            array.getattr("dtype")?
        )));
    }
    // NumPy would wrap numbers that do not fit.
    if wanted == "iu" && array.getattr("size")?.extract::<usize>()? > 0 {
        let limits = numpy.call_method1("iinfo", (dtype,))?;
        let number = |object: &Bound<'py, PyAny>, name: &str| object.getattr(name)?.extract::<i128>();
        let (least, most): (i128, i128) = (
            array.call_method0("min")?.call_method0("item")?.extract()?,
            array.call_method0("max")?.call_method0("item")?.extract()?,
        );
        if least < 0 && dtype.starts_with('u') {
            return Err(PyValueError::new_err(format!("the smallest index is {least}; indices start at 0")));
        }
        if least < number(&limits, "min")? || most > number(&limits, "max")? {
            let wrong = if most > number(&limits, "max")? { most } else { least };
            return Err(PyValueError::new_err(format!(
                "{wrong} is out of range: the numbers of this array are of type {dtype}"
            )));
        }
    }
    let options = PyDict::new(object.py());
    options.set_item("dtype", dtype)?;
    numpy.call_method("ascontiguousarray", (array,), Some(&options))
}

fn shape_error(object: &Bound<'_, PyAny>, wanted: &str) -> PyErr {
    let shape = object.getattr("shape").map_or_else(|_| "?".to_owned(), |shape| shape.to_string());
    PyValueError::new_err(format!("the array has shape {shape}; give shape {wanted}"))
}

macro_rules! input {
    ($(#[$doc:meta])* $name:ident, $inner:ident<$type:ty>, $dtype:literal, $shape:literal, $columns:expr) => {
        $(#[$doc])*
        pub struct $name<'py>($inner<'py, $type>);
        impl<'a, 'py> FromPyObject<'a, 'py> for $name<'py> {
            type Error = PyErr;
            fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
                let array = contiguous(&object, $dtype)?;
                let columns: Option<usize> = $columns;
                let array: $inner<'py, $type> = array.extract().map_err(|_| shape_error(&array, $shape))?;
                if columns.is_some_and(|columns| array.shape().last() != Some(&columns)) {
                    return Err(shape_error(array.as_any(), $shape));
                }
                Ok(Self(array))
            }
        }
        impl $name<'_> {
            fn raw(&self) -> PyResult<&[$type]> {
                Ok(self.0.as_slice()?)
            }
        }
    };
}

input!(
    /// Rows of three reals.
    Vectors, PyReadonlyArray2<f64>, "float64", "(n, 3)", Some(3)
);
input!(
    /// Reals.
    Scalars, PyReadonlyArray1<f64>, "float64", "(n,)", None
);
input!(
    /// Rows of two indices.
    Pairs, PyReadonlyArray2<u32>, "uint32", "(n, 2)", Some(2)
);
input!(
    /// Indices.
    Indices, PyReadonlyArray1<u32>, "uint32", "(n,)", None
);
input!(
    /// Rows of reals.
    Rows, PyReadonlyArray2<f64>, "float64", "(n, columns)", None
);
input!(
    /// Periodic images.
    Images, PyReadonlyArray2<i8>, "int8", "(n, 3)", Some(3)
);
input!(
    /// Booleans.
    Flags, PyReadonlyArray1<bool>, "bool", "(n,)", None
);

input!(
    /// Tensors of three by three reals.
    Tensors, PyReadonlyArray3<f64>, "float64", "(n, 3, 3)", Some(3)
);

impl Tensors<'_> {
    /// The tensors.
    pub fn get(&self) -> PyResult<Vec<Mat3>> {
        if self.0.shape()[1] != 3 {
            return Err(shape_error(self.0.as_any(), "(n, 3, 3)"));
        }
        let (rows, _) = self.raw()?.as_chunks::<9>();
        Ok(rows.iter().map(|row| Mat3::from_row_slice(row)).collect())
    }
}

impl Vectors<'_> {
    /// The rows.
    pub fn get(&self) -> PyResult<&[Vec3]> {
        Ok(bytemuck::cast_slice(self.raw()?))
    }
}
impl Scalars<'_> {
    /// The numbers.
    pub fn get(&self) -> PyResult<&[f64]> {
        self.raw()
    }
}
impl Pairs<'_> {
    /// The rows.
    pub fn get(&self) -> PyResult<&[[u32; 2]]> {
        Ok(bytemuck::cast_slice(self.raw()?))
    }
}
impl Indices<'_> {
    /// The indices.
    pub fn get(&self) -> PyResult<&[u32]> {
        self.raw()
    }
}
impl Images<'_> {
    /// The images.
    pub fn get(&self) -> PyResult<&[[i8; 3]]> {
        Ok(bytemuck::cast_slice(self.raw()?))
    }
}
impl Flags<'_> {
    /// The flags.
    pub fn get(&self) -> PyResult<&[bool]> {
        self.raw()
    }
}
impl Rows<'_> {
    /// The numbers in row-major order.
    pub fn get(&self) -> PyResult<&[f64]> {
        self.raw()
    }
    /// Number of rows and of columns.
    pub fn shape(&self) -> (usize, usize) {
        (self.0.shape()[0], self.0.shape()[1])
    }
}

/// A vector of three reals.
#[derive(Debug, Clone, Copy, Default)]
pub struct Vector(pub Vec3);
impl<'a, 'py> FromPyObject<'a, 'py> for Vector {
    type Error = PyErr;
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let array: Scalars<'py> = object.extract()?;
        match array.get()? {
            &[x, y, z] => Ok(Self(Vec3::new(x, y, z))),
            other => Err(PyValueError::new_err(format!("the vector has {} numbers; give three", other.len()))),
        }
    }
}

/// A tensor of three by three reals.
#[derive(Debug, Clone, Copy)]
pub struct Tensor(pub Mat3);
impl<'a, 'py> FromPyObject<'a, 'py> for Tensor {
    type Error = PyErr;
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let array: Rows<'py> = object.extract()?;
        if array.shape() != (3, 3) {
            return Err(PyValueError::new_err(format!("the array has shape {:?}; give shape (3, 3)", array.shape())));
        }
        Ok(Self(Mat3::from_row_slice(array.get()?)))
    }
}

/// An array of shape (n, 3).
pub fn vectors<'py>(py: Python<'py>, data: &[Vec3]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, bytemuck::cast_slice(data)).reshape([data.len(), 3])
}

/// An array of shape (3,).
pub fn vector<'py>(py: Python<'py>, data: &Vec3) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, data.as_slice())
}

/// An array of shape (n,).
pub fn scalars<'py, T: Element + Copy>(py: Python<'py>, data: &[T]) -> Bound<'py, PyArray1<T>> {
    PyArray1::from_slice(py, data)
}

/// An array of shape (3, 3); the row is the first index of the tensor.
pub fn tensor<'py>(py: Python<'py>, data: &Mat3) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, data.transpose().as_slice()).reshape([3, 3])
}

/// An array of shape (6, 6).
pub fn matrix6<'py>(py: Python<'py>, data: &Matrix6<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, data.transpose().as_slice()).reshape([6, 6])
}

/// An array of shape (n, 3, 3).
pub fn tensors<'py>(py: Python<'py>, data: Vec<Mat3>) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let mut reals = Vec::with_capacity(9 * data.len());
    for tensor in &data {
        reals.extend_from_slice(tensor.transpose().as_slice());
    }
    PyArray1::from_vec(py, reals).reshape([data.len(), 3, 3])
}

/// Rows of plain numbers as an array of shape (n, components).
pub fn rows<'py, T: Pod, E: Element + Pod>(
    py: Python<'py>,
    data: &[T],
    columns: usize,
) -> PyResult<Bound<'py, PyArray2<E>>> {
    PyArray1::from_slice(py, bytemuck::cast_slice::<T, E>(data)).reshape([data.len(), columns])
}

/// An instance of result type `name` of the package.
pub fn result<'py, A>(py: Python<'py>, name: &str, fields: A) -> PyResult<Bound<'py, PyAny>>
where
    A: pyo3::call::PyCallArgs<'py>,
{
    py.import("concordem._types")?.getattr(name)?.call1(fields)
}

/// One column of a table: name, unit, meaning, numbers by row.
pub struct TableColumn<'py> {
    /// Name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Numbers, one per row of the table.
    pub values: Bound<'py, PyAny>,
}

/// A structured array whose fields have their unit as metadata.
pub fn table<'py>(py: Python<'py>, columns: Vec<TableColumn<'py>>) -> PyResult<Bound<'py, PyAny>> {
    let list: Vec<_> = columns.into_iter().map(|c| (c.name, c.unit, c.values)).collect();
    py.import("concordem._types")?.getattr("_table")?.call1((list,))
}
