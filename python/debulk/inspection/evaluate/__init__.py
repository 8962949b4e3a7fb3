"""From a pocket to its report: by its fibre lines or its minima, and by other assumptions where a hole hides it."""
