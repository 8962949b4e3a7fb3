"""From a pocket to its report: net, minimum, ridges, and the same under other assumptions."""
